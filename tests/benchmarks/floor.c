/* The servo drive and its integrator in C by hand: the floor under our compiled step.

   Rates: those of tests/oracle_servo_drive.py.  No value of the plant stands here; test_floor.py
   fills Drive.  Integrator: RODAS3 as in workbench/rosenbrock.py, same tolerances and refinement,
   but derivatives and elimination are written for this plant: each stage solves for the velocity,
   and all else follows.  Branches not taken are not evaluated, the openings of the valve are found
   once per sample, and the Jacobian shares the powers of its rates.

   Tried on a second of the 0.5 Hz sine: time relative to this one, worst error of the position.
     1.0  147 nm  this one: the steps and the error of ours, for every command
     0.9  144 nm  its step size from the last error, at 0.8 of the tolerances
     0.9   97 nm  multirate: the gas by the RK3 of Knoth and Wolke, once per ms; between its stages
                  velocity and bristle by RODAS3, the only pair that is implicit
     1.3   79 nm  the same, but that pair by RK4 in as many steps as |v|/z_max = 2e4 1/s demands
     2.2  133 nm  ROS34PW2, a W-method, implicit in that pair alone: 3 fixed steps per ms
     2.9  142 nm  ROS2, likewise: 8 fixed steps per ms, for order 2 needs them
     4.6    1 nm  RK4: 8 fixed steps per ms, for with fewer the bristle is unstable
   What is faster by a tenth pays elsewhere: the second errs four times as much as ours on
   stick-slip, and those with fixed steps by millimetres or without bound at full voltage, all but
   the multirate RK4 (0.1 mm; ours 0.005 mm). */

#include <math.h>

#define PI 3.14159265358979323846

enum { Y, V, PA, MA, PB, MB, Z, N }; /* position, velocity, pressure and mass of gas, deflection */

typedef struct {
    double coulomb_n, excess_n, viscous_n_s_m;
} Direction;

typedef struct { /* doubles only: test_floor.py fills it as one column */
    double supply_pa, supply_k, atmosphere_pa, atmosphere_k;
    double gas_constant, kappa, temperature_exponent; /* (kappa - 1) / kappa */
    double choked_constant, critical_ratio, laminar_ratio, subsonic_factor;
    double centre_v, half_width_v, full_v, area_exponent, flow_m2, leak_m2;
    double supply_fraction, exhaust_fraction, supply_critical_ratio, exhaust_critical_ratio;
    double cracking_ratio, regular_ratio, subsonic_index;
    double area_m2, perimeter_m, stroke_m, dead_a_m3, dead_b_m3, per_kg;
    double film; /* of the wall, W/(m2 K) over the root of Pa K */
    Direction forward, backward;
    double per_stribeck_s_m, limit_m_n, breakaway_share, stiffness_n_m, damping_n_s_m;
    double stop_n_m, stop_n_s_m;
    double per_tolerance[N];
} Drive;

typedef struct { /* of the paths that are open above the centre, and below it */
    double charging_a_m2, exhausting_b_m2, charging_b_m2, exhausting_a_m2;
} Openings;

typedef struct {
    double value, slope;
} Law;

typedef struct {
    double kg_s, by_up_pa, by_down_pa, by_up_k;
} Stream;

typedef struct { /* into a chamber, with derivatives in its own pressure and temperature */
    double kg_s, k, by_pa, by_k;
} Inflow;

typedef struct { /* derivatives of a chamber's dp/dt and dm/dt */
    double pp, pm, py, pv, mp, mm, my;
} Gas;

typedef struct { /* derivatives of dv/dt and dz/dt */
    double vy, vv, vz, zv, zz;
} Slide;

static double opening_m2(const Drive *d, double beyond_v, double range_v) {
    double left = 1 - beyond_v / (range_v - d->half_width_v);
    return beyond_v > 0 ? d->flow_m2 * (1 - pow(fmax(left, 0), d->area_exponent)) : 0;
}

static Openings openings(const Drive *d, double u) {
    double above_m2 = opening_m2(d, u - d->centre_v - d->half_width_v, d->full_v - d->centre_v);
    double below_m2 = opening_m2(d, d->centre_v - d->half_width_v - u, d->centre_v);
    return (Openings){d->supply_fraction * above_m2, d->exhaust_fraction * above_m2,
                      d->supply_fraction * below_m2, d->exhaust_fraction * below_m2};
}

static inline Law nozzle(const Drive *d, double r) {
    if (r <= d->critical_ratio) return (Law){1, 0};
    double e = d->temperature_exponent, bounded = r < d->laminar_ratio ? r : d->laminar_ratio;
    double cooled = exp(e * log(bounded)), fall = 1 - cooled;
    double psi = d->subsonic_factor * bounded / cooled * sqrt(fall);
    if (r <= d->laminar_ratio) return (Law){psi, psi / r * (1 - e - 0.5 * e * cooled / fall)};
    psi /= 1 - d->laminar_ratio;
    return (Law){psi * (1 - r), -psi};
}

static inline Law iso_6358(const Drive *d, double r, double b) {
    double a = d->cracking_ratio;
    if (r <= b) return (Law){1, 0};
    if (r >= a) return (Law){0, 0};
    double s = ((r < d->regular_ratio ? r : d->regular_ratio) - b) / (a - b), rest = 1 - s * s;
    double m = d->subsonic_index, psi = exp(m * log(rest));
    if (r < d->regular_ratio) return (Law){psi, -2 * m * psi * s / (rest * (a - b))};
    psi /= a - d->regular_ratio;
    return (Law){psi * (a - r), -psi};
}

/* From the higher pressure to the lower, through the controlled hole and the leak beside it. */
static inline Stream stream(const Drive *d, double up_pa, double up_k, double down_pa,
                            double hole_m2, double b) {
    double r = down_pa / up_pa, c = d->choked_constant / sqrt(up_k);
    Law leak = nozzle(d, r), hole = hole_m2 > 0 ? iso_6358(d, r, b) : (Law){0, 0};
    double open = hole_m2 * hole.value + d->leak_m2 * leak.value;
    double slope = hole_m2 * hole.slope + d->leak_m2 * leak.slope;
    double kg_s = c * up_pa * open;
    return (Stream){kg_s, c * (open - r * slope), c * slope, -0.5 * kg_s / up_k};
}

static inline Inflow inflow(const Drive *d, double outside_pa, double outside_k, double pa,
                            double k, double hole_m2, double b) {
    if (pa <= outside_pa) {
        Stream in = stream(d, outside_pa, outside_k, pa, hole_m2, b);
        return (Inflow){in.kg_s, outside_k, in.by_down_pa, 0};
    }
    Stream out = stream(d, pa, k, outside_pa, hole_m2, b);
    return (Inflow){-out.kg_s, k, -out.by_up_pa, -out.by_up_k};
}

/* f[0] = dp/dt, f[1] = dm/dt; side is +1 where the chamber grows with the position. */
static inline void chamber(const Drive *d, const double *x, double side, double dead_m3,
                           double length_m, double v, double charging_m2, double exhausting_m2,
                           double *f, Gas *g) {
    double p = x[0], m = x[1], k = d->kappa, growth_m2 = side * d->area_m2;
    double V_m3 = dead_m3 + d->area_m2 * length_m, T = p * V_m3 / (m * d->gas_constant);
    double per_m3 = 1 / V_m3;
    Inflow in = inflow(d, d->supply_pa, d->supply_k, p, T, charging_m2, d->supply_critical_ratio);
    Inflow out = inflow(d, d->atmosphere_pa, d->atmosphere_k, p, T, exhausting_m2,
                        d->exhaust_critical_ratio);
    double film = d->film * sqrt(p * T), colder = d->supply_k - T;
    double film_m2 = film * (2 * d->area_m2 + d->perimeter_m * fmax(length_m, 0));
    double heat_w = film_m2 * colder, work_w = p * growth_m2 * v, kR = k * d->gas_constant;
    double carried = in.kg_s * in.k + out.kg_s * out.k;
    f[0] = (kR * carried - k * work_w + (k - 1) * heat_w) * per_m3;
    f[1] = in.kg_s + out.kg_s;
    if (!g) return;
    double T_p = T / p, T_m = -T / m, T_y = T * growth_m2 * per_m3; /* the gas leaves at T */
    double leaving = (p > d->supply_pa ? in.kg_s : 0) + (p > d->atmosphere_pa ? out.kg_s : 0);
    double by_T = kR * (in.by_k * in.k + out.by_k * out.k + leaving) +
                  (k - 1) * (0.5 * heat_w / T - film_m2);
    double by_p = kR * (in.by_pa * in.k + out.by_pa * out.k) - k * growth_m2 * v +
                  (k - 1) * 0.5 * heat_w / p;
    double by_y = (k - 1) * film * colder * (length_m > 0 ? d->perimeter_m * side : 0);
    double flow_T = in.by_k + out.by_k;
    g->pp = (by_p + by_T * T_p) * per_m3, g->pm = by_T * T_m * per_m3;
    g->py = (by_y + by_T * T_y - f[0] * growth_m2) * per_m3, g->pv = -k * p * growth_m2 * per_m3;
    g->mp = in.by_pa + out.by_pa + flow_T * T_p, g->mm = flow_T * T_m, g->my = flow_T * T_y;
}

/* Elasto-plastic friction, end stops and the force of the pressures. */
static inline void slide(const Drive *d, const double *x, double *f, Slide *s) {
    double v = x[V], z = x[Z], relative = v * d->per_stribeck_s_m, square = relative * relative;
    const Direction *direction = v >= 0 ? &d->forward : &d->backward;
    double excess_n = square < 50 ? direction->excess_n * exp(-square) : 0; /* e^-50 is nothing */
    double per_m = 1 / (d->limit_m_n * (direction->coulomb_n + excess_n)), bent = fabs(z) * per_m;
    double alpha = 0, alpha_z = 0; /* alpha, and z dalpha/dz */
    if (v * z > 0 && bent >= 1) alpha = 1;
    else if (v * z > 0 && bent > d->breakaway_share) {
        double width = 1 - d->breakaway_share, angle = PI * ((bent - 1) / width + 0.5);
        alpha = 0.5 * sin(angle) + 0.5, alpha_z = 0.5 * PI * cos(angle) * bent / width;
    }
    double rate = fabs(v) * per_m, z_dot = v - alpha * rate * z;
    double low_m = fmin(x[Y], 0), high_m = fmax(x[Y] - d->stroke_m, 0), stop_n = 0;
    if (low_m < 0) stop_n = fmax(-d->stop_n_m * low_m - d->stop_n_s_m * v, 0);
    if (high_m > 0) stop_n = fmin(-d->stop_n_m * high_m - d->stop_n_s_m * v, 0);
    double dry_n = d->stiffness_n_m * z + d->damping_n_s_m * z_dot + direction->viscous_n_s_m * v;
    f[Y] = v, f[Z] = z_dot;
    f[V] = (d->area_m2 * (x[PA] - x[PB]) - dry_n + stop_n) * d->per_kg;
    if (!s) return;
    double limit_v = -2 * relative * d->per_stribeck_s_m * d->limit_m_n * excess_n;
    s->zz = -rate * (alpha + alpha_z);
    s->zv = 1 - alpha * (v >= 0 ? z : -z) * per_m - s->zz * z * per_m * limit_v;
    s->vz = -(d->stiffness_n_m + d->damping_n_s_m * s->zz) * d->per_kg;
    s->vy = stop_n != 0 ? -d->stop_n_m * d->per_kg : 0;
    double viscous_n_s_m = direction->viscous_n_s_m + (stop_n != 0 ? d->stop_n_s_m : 0);
    s->vv = -(d->damping_n_s_m * s->zv + viscous_n_s_m) * d->per_kg;
}

static void right_hand_side(const Drive *d, const Openings *o, const double *x, double *f, Gas *a,
                            Gas *b, Slide *s) {
    double y = x[Y], v = x[V];
    chamber(d, x + PA, +1, d->dead_a_m3, y, v, o->charging_a_m2, o->exhausting_a_m2, f + PA, a);
    chamber(d, x + PB, -1, d->dead_b_m3, d->stroke_m - y, v, o->charging_b_m2, o->exhausting_b_m2,
            f + PB, b);
    slide(d, x, f, s);
}

/* W = I / (h gamma) - J, eliminated down to the velocity: y and m, then p, then z. */
typedef struct {
    double y, z, v, push; /* inverse pivots, and the force of the pressures */
    double m_a, p_a, v_a, m_b, p_b, v_b;
    Gas a, b;
    Slide s;
} Factors;

static Factors factorised(const Drive *d, double diagonal, Gas a, Gas b, Slide s) {
    Factors w = {.y = 1 / diagonal, .z = 1 / (diagonal - s.zz), .a = a, .b = b, .s = s};
    w.push = d->area_m2 * d->per_kg;
    w.m_a = 1 / (diagonal - a.mm), w.m_b = 1 / (diagonal - b.mm);
    w.p_a = 1 / (diagonal - a.pp - a.pm * w.m_a * a.mp);
    w.p_b = 1 / (diagonal - b.pp - b.pm * w.m_b * b.mp);
    w.v_a = w.p_a * (a.pv + (a.py + a.pm * w.m_a * a.my) * w.y);
    w.v_b = w.p_b * (b.pv + (b.py + b.pm * w.m_b * b.my) * w.y);
    w.v = 1 / (diagonal - s.vv - s.vy * w.y - s.vz * w.z * s.zv - w.push * (w.v_a - w.v_b));
    return w;
}

static void solve(const Factors *w, const double *right, double *k) {
    const Gas *a = &w->a, *b = &w->b;
    double y = right[Y] * w->y, m_a = right[MA] + a->my * y, m_b = right[MB] + b->my * y;
    double p_a = (right[PA] + a->py * y + a->pm * w->m_a * m_a) * w->p_a;
    double p_b = (right[PB] + b->py * y + b->pm * w->m_b * m_b) * w->p_b;
    double z = right[Z] * w->z;
    k[V] = (right[V] + w->s.vy * y + w->s.vz * z + w->push * (p_a - p_b)) * w->v;
    k[Y] = y + k[V] * w->y;
    k[Z] = z + w->s.zv * k[V] * w->z;
    k[PA] = p_a + w->v_a * k[V], k[PB] = p_b + w->v_b * k[V];
    k[MA] = (right[MA] + a->my * k[Y] + a->mp * k[PA]) * w->m_a;
    k[MB] = (right[MB] + b->my * k[Y] + b->mp * k[PB]) * w->m_b;
}

/* One step of RODAS3; returns the sum of squares of its error over the tolerances. */
static double single_step(const Drive *d, const Openings *o, const double *x, double h,
                          double *to) {
    double f[N], right[N], k1[N], k2[N], k3[N], k4[N], per_s = 1 / h, error = 0;
    Gas a, b;
    Slide s;
    right_hand_side(d, o, x, f, &a, &b, &s);
    Factors w = factorised(d, 2 * per_s, a, b, s);
    solve(&w, f, k1);
    for (int i = 0; i < N; i++) right[i] = f[i] + 4 * per_s * k1[i];
    solve(&w, right, k2);
    for (int i = 0; i < N; i++) to[i] = x[i] + 2 * k1[i];
    right_hand_side(d, o, to, f, 0, 0, 0);
    for (int i = 0; i < N; i++) right[i] = f[i] + per_s * (k1[i] - k2[i]);
    solve(&w, right, k3);
    for (int i = 0; i < N; i++) to[i] += k3[i];
    right_hand_side(d, o, to, f, 0, 0, 0);
    for (int i = 0; i < N; i++) right[i] = f[i] + per_s * (k1[i] - k2[i] - 8.0 / 3 * k3[i]);
    solve(&w, right, k4);
    for (int i = 0; i < N; i++) {
        double share = k4[i] * d->per_tolerance[i];
        to[i] += k4[i], error += share * share;
    }
    return error;
}

/* A step whose error is too large, or not a number, is done again in finer ones. */
static void advance(const Drive *d, const Openings *o, double *x, double h, int levels, int finer) {
    double to[N], error = single_step(d, o, x, h, to);
    if (error < 1 || levels == 1)
        for (int i = 0; i < N; i++) x[i] = to[i];
    else
        for (int i = 0; i < finer; i++) advance(d, o, x, h / finer, levels - 1, finer);
}

void rates(const Drive *d, const double *x, double u, double *f) {
    Openings o = openings(d, u);
    right_hand_side(d, &o, x, f, 0, 0, 0);
}

/* x holds N numbers per sample, the first sample given; the command is held between samples. */
void simulate(const Drive *d, const double *u, long samples, double sample_time_s, int levels,
              int finer, double *x) {
    for (long n = 1; n < samples; n++, x += N) {
        Openings o = openings(d, u[n - 1]);
        for (int i = 0; i < N; i++) x[N + i] = x[i];
        advance(d, &o, x + N, sample_time_s, levels, finer);
    }
}
