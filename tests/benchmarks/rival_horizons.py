"""Others' moving-horizon estimation on the window of one of our estimates: SLSQP and do-mpc.

Each takes (estimator, window) and gives a function that solves the window's problem once, from the
prior, and returns the constant that it finds.  Windows have no process noise, and no bound that is
active.
"""

import warnings

import casadi as ca
import numpy as np
import pytest
from oracle_soft_joint_parametric import P_ATM, P_SRC, area_map
from scipy.optimize import minimize


def read(estimator, window):
    """The parts of a window's tape by name."""
    functions = estimator.functions
    return {name: functions.part(window.tape, name) for name in functions.sizes}


def by_slsqp(estimator, window):
    """The soft joint in plain Python, stepped by Runge-Kutta, as paper 004 has it."""
    now = read(estimator, window)
    scale, (plant, dt) = estimator.kalman.filter.scale, (estimator.plant, estimator.sample_time_s)
    nominal = plant.values["valve.time_constant_s"]
    openings = [area_map(u) for u in now["u"][0, :-1]]
    weight = np.linalg.inv(now["prior"][:, 1:])
    measured, r = now["y"][0].tolist(), estimator.measurement_noise["bellows.pressure_pa"]

    def cost(X):
        tau, p = nominal + scale[1] * X[1], scale[0] * X[0]
        off = X - now["prior"][:, 0]
        total = off @ weight @ off + (measured[0] - p / r) ** 2
        for a, y in zip(openings, measured[1:], strict=True):
            rate = (lambda p, a=a: a * (P_SRC - p) / tau) if a >= 0 else (
                lambda p, a=a: a * (p - P_ATM) / tau
            )  # fmt: skip
            k1 = rate(p)
            k2 = rate(p + 0.5 * dt * k1)
            k3 = rate(p + 0.5 * dt * k2)
            p += dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rate(p + dt * k3))
            total += (y - p / r) ** 2
        return total

    low, high = (((b - nominal) / scale[1]) for b in estimator.bounds["valve.time_constant_s"])

    def solve():
        found = minimize(
            cost, now["prior"][:, 0], method="SLSQP", bounds=[(0.5, 6.0), (low, high)],
            options={"ftol": 1e-9},
        )  # fmt: skip
        return nominal + scale[1] * found.x[1]

    return solve


def by_do_mpc(estimator, window):
    """do-mpc's estimator with collocation and IPOPT, given the same window and prior."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        do_mpc = pytest.importorskip("do_mpc", reason="do-mpc is not installed")
    now, plant = read(estimator, window), estimator.plant
    (constant,), n_x = estimator.constants, len(plant.model.states)
    scale, M = estimator.kalman.filter.scale, estimator.horizon
    model = do_mpc.model.Model("continuous", "SX")
    x = [model.set_variable("_x", f"x{k}") for k in range(n_x)]
    u = [model.set_variable("_u", f"u{k}") for k in range(len(plant.commands))]
    moved = model.set_variable("_p", "moved")  # in our units, from the plant's own value
    p = ca.SX(ca.DM(plant.nominal[2]))
    p[plant.model.parameters.index(constant)] += scale[n_x] * moved
    rates, outputs = plant.model.f(ca.vertcat(*x) * scale[:n_x], ca.vertcat(*u), [], p)
    noise = np.array([estimator.measurement_noise[name] for name in plant.measured])
    for k in range(n_x):
        model.set_rhs(f"x{k}", rates[k] / scale[k])
    for k in range(len(noise)):
        model.set_meas(f"y{k}", outputs[k] / noise[k], meas_noise=True)
    for k in range(len(u)):
        model.set_meas(f"u{k}_seen", u[k], meas_noise=False)
    model.setup()
    mhe = do_mpc.estimator.MHE(model, ["moved"])
    mhe.settings.n_horizon = M - 1
    mhe.settings.t_step = estimator.sample_time_s
    mhe.settings.meas_from_data = True
    mhe.settings.nlpsol_opts = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes"}
    H, y = now["H"][:, : n_x + 1], now["y"][:, 0]  # do-mpc does not take the first measurement
    weight = np.linalg.inv(now["prior"][:, 1:])
    mean = np.linalg.solve(weight + H.T @ H, weight @ now["prior"][:, 0] + H.T @ y)
    weight = weight + H.T @ H
    mhe.set_default_objective(
        P_x=weight[:n_x, :n_x], P_v=np.eye(len(noise)), P_p=weight[n_x:, n_x:]
    )
    bound = estimator.bounds.get(constant)
    if bound:
        low, high = ((b - plant.values[constant]) / scale[n_x] for b in bound)
        mhe.bounds["lower", "_p_est", "moved"], mhe.bounds["upper", "_p_est", "moved"] = low, high
    template = mhe.get_y_template()
    for k in range(M - 1):
        template["y_meas", k] = np.hstack([now["y"][:, k + 1], now["u"][:, k]])
    mhe.set_y_fun(lambda _: template)
    mhe.setup()

    def solve():
        mhe.reset_history()
        mhe.x0, mhe.p_est0 = mean[:n_x], mean[n_x:]
        mhe.set_initial_guess()
        mhe.make_step(np.array(template["y_meas", -1]))
        return plant.values[constant] + scale[n_x] * float(mhe.p_est0["moved"])

    return solve
