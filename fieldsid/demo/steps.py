"""The steps of the tour: each a command as a user would type it, and what its result means, in words with its numbers.

PLAN comes before the vehicle swims, STEPS are what is done with its logs.
A line is a template over the names of `places` and over what earlier steps have learned; a word with `*` stands for the
files it matches. A step whose line needs what nobody has learned is left out. A later step is one more entry in STEPS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Formatter

from fieldsid.comparison.sufficient import is_noise, over_noise
from fieldsid.demo import briefs
from fieldsid.demo.trial import CHECK_SPEEDS, PLANNED_SPEED
from fieldsid.demo.vehicle import LIMITS
from fieldsid.maneuvers import pick_maneuver
from fieldsid.models.axis import Axis
from fieldsid.planning.design.leg import error_in_words
from fieldsid.rounding import number, with_error
from fieldsid.turning.prediction import turn_words

Result = briefs.Result
CHECKED = " ".join(f"--validate {{runs}}/check_{speed:.1f}.parquet" for speed in CHECK_SPEEDS)
"""The runs that judge; the option stands before each, as a shell gives only the first of a pattern's files to an option."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step: its heading, its command line after `sysid`, its result in a few words and what it means, and its axes.

    learns gives, from the result, what later lines may name.
    """

    title: str
    line: str
    brief: Callable[[Result], str]
    means: Callable[[Result], str]
    axes: tuple[Axis, ...] = tuple(Axis)
    learns: Callable[[Result], Mapping[str, str]] = lambda _result: {}

    def possible(self, known: Mapping[str, str]) -> bool:
        """Whether everything the line names is known."""
        return {name for _, name, _, _ in Formatter().parse(self.line) if name} <= set(known)


def places(folder: Path, axis: str) -> dict[str, str]:
    """Return what the lines' templates stand for."""
    return {
        "folder": str(folder),
        "plan": str(folder / "plan"),
        "trial": str(folder / "trial"),
        "mapping": str(folder / "mapping.yaml"),
        "runs": str(folder / "runs"),
        "models": str(folder / "models"),
        "final": str(folder / "final"),
        "turning": str(folder / "turning"),
        "fits": str(folder / "models" / f"learn_*_{axis}.yaml"),
        "axis": axis,
    }


def words_of(line: str, known: Mapping[str, str]) -> list[str]:
    """Return the words of a line, templates filled in, still with their patterns."""
    return [word.format(**known) for word in line.split()]


def expanded(words: Sequence[str]) -> list[str]:
    """Return the words with every pattern replaced by the files it matches, in order, as a shell does."""
    out: list[str] = []
    for word in words:
        matches = sorted(str(p) for p in Path(word).parent.glob(Path(word).name)) if "*" in word else []
        out += matches or [word]
    return out


def _planned(result: Result) -> str:
    leg = result["legs"][0]
    window = leg["window"]
    seconds = window["length_s"] - window["lead_s"] - window["recover_s"]
    bought = [e | {"name": name} for name, e in leg["expected"].items() if e["relative"] and e["baseline"]]
    errors = ", ".join(f"{e['name']} to {error_in_words(e['value'], e['std_error'], e['relative'])}" for e in bought)
    hardest = max(bought, key=lambda e: (e["baseline"] / e["std_error"]) ** 2)
    figure = next(f for f in result["files"] if f.endswith(".png"))
    return (
        f"{seconds:.0f} s of the maneuver {leg['maneuver']}, in which {pick_maneuver(leg['maneuver']).says}, are expected to buy "
        f"{errors}. For the same error of {hardest['name']} the usual pulses would take "
        f"{(hardest['baseline'] / hardest['std_error']) ** 2:.1f} times as long. {figure} shows the fin, the angle expected "
        "inside its limits, and the track; the CSV beside it is what the vehicle is sent."
    )


def _inspected(result: Result) -> str:
    return (
        "The logger writes degrees under names of its own. The proposed mapping says which column is which signal and in which "
        "unit; look it over, then import with it."
    )


def _imported(result: Result) -> str:
    return "Each log is now a run: SI and radians, headings unwrapped, one clock. From here on no command needs the mapping."


def _identified(result: Result) -> str:
    fits = result["fits"]
    name = next(iter(fits[0]["parameters"]))
    parts = "; ".join(
        f"{number(f['speed_m_s'], 2)} m/s: {with_error(f['parameters'][name]['value'], f['parameters'][name]['std_error'])}"
        for f in fits
    )
    return f"{name} over speed is {parts} 1/s. " + _verdict(max(over_noise(f, f["noise_floor"]) for f in fits))


def _joined(result: Result) -> str:
    fit = result["fits"][0]
    return (
        f"One model for {len(fit['runs'])} speeds: damping shared, authority by speed. "
        + _verdict(over_noise(fit, fit["noise_floor"]))
        + " Its judge are runs it has not seen."
    )


def _compared(result: Result) -> str:
    run = max(result["runs"], key=lambda r: float(r["over_noise"]))
    opening = f"On {run['run']}, which the fit has not seen, the {_fits(run, run['over_floor'])}. "
    if not run["failing"]:
        return opening + "That is the noise: here the model lacks nothing."
    worst = run["where"][0]
    return (
        f"{opening}{100 * worst['share_of_error']:.0f} % of the {run['judged_by']}'s squared error falls on "
        f"`{worst['condition']}` ({worst['rms_ratio']:.1f} x the run's own rms, worst from {worst['t_start_s']:.1f} to "
        f"{worst['t_end_s']:.1f} s): that is where to look for what the model lacks."
    )


def _fits(run: Result, over: Mapping[str, float]) -> str:
    """Return the fit of each channel and its error over its noise, the one that is followed worse first."""
    return " and the ".join(f"{n} fit is {number(run[f'{n}_fit_percent'], 3)} % ({x:.1f} x its noise)" for n, x in over.items())


def _diagnosed(result: Result) -> str:
    if not result["effects"]:
        return f"The verdict is {result['verdict']}: no effect of the catalogue is named, and none is added below."
    first = result["candidates"][0]
    return (
        f"Every effect of the catalogue was added in turn and judged on runs it had not seen: {first['effect']} has probability "
        f"{number(first['probability'], 3)} and explains {100 * first['explained']:.0f} % of what the noise does not."
    )


def _named(result: Result) -> Mapping[str, str]:
    return {"effects": ",".join(result["effects"])} if result["effects"] else {}


def _extended(result: Result) -> str:
    before, after = (result["over_floor"][when] for when in ("before", "after"))
    if not result["kept"]:
        return (
            f"On runs not seen the error goes from {before:.2f} to {after:.2f} x the noise: it does not pay, so nothing is kept."
        )
    return f"On runs not seen the error falls from {before:.2f} to {after:.2f} x the noise. 1 is where the sensors end, so " + (
        f"something is left to find: `{result['next']}`." if result["left"]["more_than_noise"] else "nothing is left to find."
    )


def _grown(result: Result) -> Mapping[str, str]:
    return {"extended": str(result["model"])}


def _remembered(result: Result) -> str:
    return (
        "Each model knows its parent, its data by their hash, and the error before and after: "
        f"the figure shows it falling to the noise floor, {result['figure']}."
    )


def _held(result: Result) -> str:
    said = "; ".join(f"on {run['run']} the {_fits(run, run['over_floor'])}" for run in result["runs"])
    return f"The same runs again, now with the effect: {said}."


def _refitted(result: Result) -> str:
    left = max(over_noise(f, f["noise_floor"]) for f in result["fits"])
    name = next(iter(result["fits"][0]["parameters"]))
    said = {
        f["run"]: f"{100 * briefs.relative(f['parameters'][name]):.1f} %" for f in result["fits"] if f["run"].startswith("learn")
    }
    planned = said.pop(f"learn_{PLANNED_SPEED:.1f}")
    return (
        "With the effect in the model every run may be fitted, those that judged too, which gives two more speeds. The planned "
        f"run tells {name} to {planned}, the other two to {' and '.join(said.values())}. " + _verdict(left)
    )


def _replaced(result: Result) -> Mapping[str, str]:
    return {"fits": str(Path(result["fits"][0]["model"]).parent / "*.yaml")}


def _lawful(result: Result) -> str:
    laws = {name: law for name, law in result["laws"].items() if law.get("exponent")}
    said = "; ".join(f"|{name}| grows as {law['exponent']['says']}" for name, law in laws.items())
    return f"{said or 'Each parameter has its law over speed'}. The laws carry the model to speeds that were not flown."


def _turned(result: Result) -> str:
    rows = result["rows"]
    tightest = min(rows, key=lambda row: float(row["radius_m"]))
    where = f"at {number(tightest['speed_m_s'], 2)} m/s to {tightest['side']}"
    return (
        f"The tightest turn is {turn_words(float(tightest['radius_m']), tightest['interval95'], where)}, and it is "
        f"{tightest['trust']}: "
        "what was flown may never show a settled turn, and a wide band says so."
    )


def _scheduled(result: Result) -> str:
    first, last = result["rows"][0], result["rows"][-1]
    return (
        f"kp goes from {number(abs(first['kp']), 2)} at {number(first['speed_m_s'], 2)} m/s to "
        f"{number(abs(last['kp']), 2)} at {number(last['speed_m_s'], 2)} m/s, so that all speeds settle alike with no more "
        "fin than that takes; the feed-forward holds the fin's own trim."
    )


def _verified(result: Result) -> str:
    ours, constant = (max(briefs.settled(c) for c in result[part]) for part in ("scheduled", "constant"))
    fin, its = (100.0 * result[part][-1]["fin_use"] for part in ("scheduled", "constant"))
    return (
        f"The least phase margin over speeds and errors is {result['worst']['phase_margin_deg']:.0f} deg. A heading step settles "
        f"within {ours:.0f} s at every speed, with one constant gain within {constant:.0f} s; at the highest speed it asks for "
        f"{fin:.0f} % of the fin, with one constant gain for {its:.0f} %."
    )


def _exported(result: Result) -> str:
    return (
        "Flat arrays of equal length, a decimal point in every number: a ROS 2 node loads them as they are. `--into` puts them "
        "into a configuration file you already have, and shows the difference first."
    )


def _reported(result: Result) -> str:
    return (
        f"{result['file']} is one page of {result['bytes'] / 1e6:.1f} MB that needs no network: verdicts first, then "
        f"{result['figures']} figures to zoom and read off, every number, what was made from what, and how to repeat it."
    )


def _verdict(ratio: float) -> str:
    if is_noise(ratio):
        return f"What is left is {ratio:.2f} x the sensors' noise: nothing more to explain."
    return f"What is left is {ratio:.1f} x the sensors' noise: the model's form, not its numbers, lacks something."


PLAN = Step(
    "What to fly?",
    f"plan --axis {{axis}} --speeds {PLANNED_SPEED} --fin-rate {LIMITS.fin_rate:g} --write csv -o {{plan}}",
    briefs.planned,
    _planned,
)
STEPS: tuple[Step, ...] = (
    Step("What is in the log?", "inspect {trial}/learn_1.4.csv --write-mapping {mapping}", briefs.inspected, _inspected),
    Step("From log to run", "import {trial}/*.csv --mapping {mapping} -o {runs}", briefs.imported, _imported),
    Step(
        "A model for each speed",
        "identify {runs}/learn_*.parquet --axis {axis} -o {models} --no-figures",
        briefs.fitted,
        _identified,
    ),
    Step(
        "One model for all speeds",
        "identify {runs}/learn_*.parquet --axis {axis} --joint -o {models} --no-figures",
        briefs.fitted,
        _joined,
    ),
    Step(
        "Does it hold on runs it has not seen?",
        "compare {models}/joint_{axis}.yaml {runs}/check_*.parquet -o {models}",
        briefs.compared,
        _compared,
    ),
    Step(
        "Which physical effect is missing?",
        f"diagnose {{runs}}/learn_*.parquet --axis {{axis}} {CHECKED} -o {{models}}/diagnosis.yaml "
        "--figure {models}/diagnosis.png",
        briefs.diagnosed,
        _diagnosed,
        learns=_named,
    ),
    Step(
        "Add it, and watch the error fall",
        f"extend {{models}}/joint_{{axis}}.yaml {{runs}}/learn_*.parquet --add {{effects}} {CHECKED}",
        briefs.extended,
        _extended,
        learns=_grown,
    ),
    Step("How did this model come about?", "history {extended} --figure {models}/history.png", briefs.remembered, _remembered),
    Step("Does it hold now?", "compare {extended} {runs}/check_*.parquet -o {final}", briefs.compared, _held),
    Step(
        "A better model for each speed",
        "identify {runs}/*.parquet --axis {axis} --effects {effects} -o {final}/speeds --no-figures",
        briefs.refitted,
        _refitted,
        learns=_replaced,
    ),
    Step("How do the numbers change with speed?", "fit {fits} -o {final}/law_{axis}.yaml", briefs.lawful, _lawful),
    Step("How tight does it turn?", "turn-radius {fits} --speeds 1.0,1.4,1.8 -o {turning}", briefs.turned, _turned, (Axis.YAW,)),
    Step(
        "Gains for every speed",
        "schedule design {fits} --fin-max 0.26 -o {turning}/gains.yaml",
        briefs.scheduled,
        _scheduled,
        (Axis.YAW,),
    ),
    Step(
        "Are they good, also between the speeds?",
        "schedule verify {turning}/gains.yaml --require-phase-margin 30 -o {turning}/gains.png",
        briefs.verified,
        _verified,
        (Axis.YAW,),
    ),
    Step(
        "Into the vehicle",
        "schedule export {turning}/gains.yaml --to ros2 -o {turning}/heading_ros2.yaml",
        briefs.exported,
        _exported,
        (Axis.YAW,),
    ),
    Step("All of it in one file", "report {folder}", briefs.reported, _reported),
)
