"""A page for every effect of the catalogue, with the figure of its telltale, and the page that lists them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from textwrap import fill
from typing import Any

from guide.pictures import small_png
from guide.telltales import Telltale, figure, noise_in_words, telltale_of

from fieldsid.demo.vehicle import SPEED
from fieldsid.maneuvers import all_maneuvers

COLUMNS = 78
STAGES = {
    "actuator": "between the command and the fin angle that acts",
    "hydrodynamics": "in the equation of motion",
    "sensor": "between the motion and what is logged of it",
}
INDEX = """# Effects

What a vehicle has besides `a22 b2 C0` (yaw) and `c22 c23 d2 Cb` (pitch). Each effect is one file of the program that declares all
that any command may ask of it; the pages here are made from those files. `p` is the rate (`r` in yaw, `q` in pitch), `f` the
speed over the speed the model's parameters hold at. `sysid effects list` lists them, `sysid effects show NAME` shows one, and
one of your own is a file of a few lines: [Writing your own](../extending.md).
"""


def pages(effects: Sequence[Mapping[str, Any]]) -> dict[str, str | bytes]:
    """Return the pages of effects, given as `sysid effects list --json` gives them, and their figures, by path in `effects/`."""
    out: dict[str, str | bytes] = {"index.md": index(effects)}
    for effect in effects:
        told = telltale_of(effect["name"])
        out[f"{effect['name']}.md"] = page(effect, told, {e["name"]: e["says"] for e in effects})
        out[f"{effect['name']}.png"] = small_png(figure(told))
    return out


def index(effects: Sequence[Mapping[str, Any]]) -> str:
    """Return the page that lists the effects by stage."""
    parts = [INDEX]
    for stage, where in STAGES.items():
        rows = [(f"[{e['name']}]({e['name']}.md)", ", ".join(e["axes"]), e["says"]) for e in effects if e["stage"] == stage]
        parts.append(f"## {stage.capitalize()}\n\nActs {where}.\n\n{table(('effect', 'axes', 'in plain words'), rows)}")
    return "\n".join(parts)


def page(e: Mapping[str, Any], told: Telltale, says: Mapping[str, str]) -> str:
    """Return one effect's page; says gives every effect's plain words."""
    return "\n".join(
        [
            f"# {e['name']}\n\n{sentence(e['says'])}\n\n```text\n{e['equation']}\n```\n",
            _facts(e),
            "## Coefficients\n\n" + _coefficients(e["coefficients"]),
            _telltale(e, told),
            "## What excites it\n\n" + _maneuvers(e["excited_by"]),
            "## What it is mistaken for\n\n" + "".join(f"- [{n}]({n}.md): {says[n]}\n" for n in e["mistaken_for"]),
            *([_forms(e["forms"], set(e["needs"]))] if e["forms"] else []),
            f"## In full\n\n```text\n{_in_full(e['name'])}\n```\n",
            f"## Add it\n\n```text\nsysid extend MODEL RUN... --add {e['name']} --validate RUN\n```\n",
        ]
    )


def _facts(e: Mapping[str, Any]) -> str:
    facts = {
        "acts": STAGES[e["stage"]],
        "planes": " and ".join(e["axes"]),
        "the log must have": ", ".join(e["needs"]) or "nothing more",
        "states it adds": ", ".join(e["extra_states"]) or "none",
        "source": e["source"],
    }
    return "".join(f"- {name}: {fact}\n" for name, fact in facts.items())


def _coefficients(coefficients: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (f"`{c['name']}`", c["unit"], f"{c['low']:g} .. {c['high']:g}", f"{c['start']:g}", c["says"] + _own(c))
        for c in coefficients
    ]
    return table(("name", "unit", "bounds", "start", "is"), rows)


def _own(c: Mapping[str, Any]) -> str:
    return " (each run has its own)" if c["per_run"] else ""


def _telltale(e: Mapping[str, Any], told: Telltale) -> str:
    strength = ", ".join(f"`{n} = {v:g}`" for n, v in told.strength.items())
    return (
        f"## Telltale\n\n{sentence(e['telltale'])}\n\n![telltale of {e['name']}]({e['name']}.png)\n\n"
        f"The tour's vehicle with {strength} flies `{told.maneuver}` at {SPEED:g} m/s. Dark: its rate, without the sensors' "
        "noise. Orange: the model without the effect, fitted to the log of that flight. Below: measured less simulated, over the "
        f"sensors' noise ({noise_in_words()}).\n"
    )


def _maneuvers(names: Sequence[str]) -> str:
    known = all_maneuvers()
    return "".join(f"- `{n}`: {known[n].says}\n" if n in known else f"- `{n}`\n" for n in names)


def _forms(forms: Sequence[Mapping[str, Any]], needed: set[str]) -> str:
    parts = ["## Other forms\n\nTried where the form above leaves something; each takes these numbers besides.\n"]
    for form in forms:
        where = [f"{' and '.join(form['axes'])} only"] if len(form["axes"]) == 1 else []
        more = [role for role in form["needs"] if role not in needed]
        needs = [f"needs {' and '.join(more)}"] if more else []
        tail = f" ({'; '.join([*where, *needs])})" if where or needs else ""
        parts.append(f"{sentence(form['says'] + tail)}\n\n{_coefficients(form['coefficients'])}")
    return "\n".join(parts)


def _in_full(name: str) -> str:
    """Return what the effect's own file says of it, paragraphs filled and equations as they stand."""
    text = import_module(f"fieldsid.effects.{name}").__doc__ or ""
    out, words = list[str](), list[str]()
    for line in [*text.strip().splitlines(), ""]:
        if line.strip() and not line.startswith("    "):
            words.append(line)
            continue
        if words:
            out.append(fill(" ".join(words), COLUMNS))
        words = []
        out.append(line.rstrip())
    return "\n".join(out).strip("\n")


def sentence(text: str) -> str:
    """Return text as a sentence."""
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [columns, ["---"] * len(columns), *([str(v).replace("|", "\\|") for v in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
