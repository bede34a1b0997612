"""An empirical law as text and as a document: what it is, what it explains, where it was seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from studies.plain import plain
from studies.text import removed, shown
from workbench.diagnosis.result import Law, told
from workbench.effects.empirical import EmpiricalForce
from workbench.effects.empirical_fillings import EmpiricalFilling, ScaledFilling
from workbench.rig_laws import laws_of
from workbench.units import public_name, si_unit

Term = EmpiricalForce | EmpiricalFilling
HOW = "`workbench add RIG law --fit ...` takes it, `improve --law` does where nothing else helps"


def law_text(law: Law) -> str:
    """What an empirical law explains, its terms as formulas, and where it was seen."""
    ranges = (
        f"{public_name(name)} {shown(low, name, 3)} to {shown(high, name, 3)}"
        for name, (low, high) in law.ranges.items()
    )
    names = " ".join(f'"{step.candidate.name}"' for step in law.steps)
    return "\n".join((
        f"law (empirical, not a physical effect): {names}; "
        f"drop train {removed(law.drop_train)}, validation {removed(law.drop_validation)}; "
        f"seen for {', '.join(ranges)}",
        *(_formula(term, sizes) for term, sizes in _terms(law)),
    ))  # fmt: skip


def law_document(law: Law) -> dict[str, Any]:
    """An empirical law: its terms, the sizes they are counted in, its ranges, what adds it."""
    return {
        "balance": law.balances[0],
        "balances": sorted(law.balances),
        "terms": {
            public_name(name): {
                "value": plain(size.value),
                "unit": si_unit(name),
                "std": plain(size.deviation),
            }
            for name, size in law.terms.items()
        },
        "formulas": {
            term.name: {
                "formula": term.formula,
                "sizes": {
                    public_name(name): {"value": plain(value), "unit": si_unit(name)}
                    for name, value in sizes.items()
                },
            }
            for term, sizes in _terms(law)
        },
        "ranges": {
            public_name(name): {"low": plain(low), "high": plain(high), "unit": si_unit(name)}
            for name, (low, high) in law.ranges.items()
        },
        "error_drop_train": plain(told(law.drop_train)),
        "error_drop_validation": plain(told(law.drop_validation)),
        "text": law.text,
        "kind": "empirical",
        "add": [step.candidate.name for step in law.steps],
    }


def _terms(law: Law) -> Iterator[tuple[Term, Mapping[str, float]]]:
    """Its terms, each with the sizes in SI by full name that its factors are counted in."""
    if law.fit is None:
        return
    values, own = law.fit.plant.values, {step.candidate.member for step in law.steps}
    for term in laws_of(law.fit.windows.plant):
        if term.name in own:
            names = (f"{term.name}.{form}" for form in term.counted_in)
            yield term, {name: values[name] for name in names}


def _formula(term: Term, sizes: Mapping[str, float]) -> str:
    """``law[v x]@slide: F = a v x, v in 0.31 m/s, x from 140 mm in half of 220 mm``."""
    counted = {name.rpartition(".")[2]: shown(value, name, 3) for name, value in sizes.items()}
    said = [f"{term.name}: {term.formula}"]
    if "speed_m_s" in counted:
        said.append(f"v in {counted['speed_m_s']}")
    if "stroke_m" in counted:
        said.append(f"x from {counted['middle_m']}, alone in half of L = {counted['stroke_m']}")
    elif "middle_m" in counted:
        said.append(f"mid = {counted['middle_m']}")
    if "pressure_pa" in counted:
        what = "p above ambient" if isinstance(term, ScaledFilling) else "dp"
        said.append(f"{what} in {counted['pressure_pa']}")
    if isinstance(term, ScaledFilling) and term.command:
        rest, span = (shown(value, term.command, 4) for value in (term.rest, term.span))
        said.append(f"u from {rest} in {span}")
    return ", ".join(said)
