"""The steps of the tour: each is a command as a user would type it, with the meaning of its result in words and numbers.

PLAN comes before the flight, STEPS work on its logs. A line is a template with the names of `places` and the names that earlier
steps define (`Step.learns`); a word with `*` stands for the files it matches. A step whose line needs an undefined name is left
out. To add a step, add an entry to STEPS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from string import Formatter
from typing import Any

from fieldsid.comparison.sufficient import is_noise, over_noise
from fieldsid.demo.trial import CHECK_SPEEDS
from fieldsid.demo.vehicle import LIMITS, SPEED
from fieldsid.maneuvers import pick_maneuver
from fieldsid.models.axis import Axis
from fieldsid.planning.design.leg import error_in_words
from fieldsid.rounding import number, with_error
from fieldsid.turning.prediction import turn_words

Result = Mapping[str, Any]
Report = tuple[str, str]
"""The report on a step: its result in a few words with numbers, for the short tour, and its meaning."""
CHECKED = " ".join(f"--validate {{runs}}/check_{speed:.1f}.parquet" for speed in CHECK_SPEEDS)
"""The validation runs, each with its option, as a shell passes only the first file of a pattern to an option."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step: its heading, its command line after `sysid`, the function that reports on its result, and its axes.

    `learns` returns names, defined by the result, for use in the lines of later steps.
    """

    title: str
    line: str
    tells: Callable[[Result], Report]
    axes: tuple[Axis, ...] = tuple(Axis)
    learns: Callable[[Result], Mapping[str, str]] = lambda _result: {}

    def possible(self, known: Mapping[str, str]) -> bool:
        """Whether all names in the line are defined."""
        return {name for _, name, _, _ in Formatter().parse(self.line) if name} <= set(known)


def places(folder: Path, axis: str) -> dict[str, str]:
    """Return the names with which the lines' templates are filled."""
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
    """Return the words of a line with templates filled in, but patterns not yet expanded."""
    return [word.format(**known) for word in line.split()]


def expanded(words: Sequence[str]) -> list[str]:
    """Return the words with every pattern replaced by the files it matches, in order, as a shell does."""
    out: list[str] = []
    for word in words:
        matches = sorted(str(p) for p in Path(word).parent.glob(Path(word).name)) if "*" in word else []
        out += matches or [word]
    return out


def _report_plan(result: Result) -> Report:
    leg = result["legs"][0]
    window = leg["window"]
    seconds = window["length_s"] - window["lead_s"] - window["recover_s"]
    bought = {name: e for name, e in leg["expected"].items() if e["relative"] and e["baseline"]}
    errors = ", ".join(f"{n} to {error_in_words(e['value'], e['std_error'], e['relative'])}" for n, e in bought.items())
    hardest, times = max(((n, (e["baseline"] / e["std_error"]) ** 2) for n, e in bought.items()), key=itemgetter(1))
    figure = next(f for f in result["files"] if f.endswith(".png"))
    return f"{window['length_s']:.0f} s at {leg['speed_m_s']:.1f} m/s will buy {errors}", (
        f"{seconds:.0f} s of the maneuver {leg['maneuver']}, in which {pick_maneuver(leg['maneuver']).says}, are expected to buy "
        f"{errors}. For the same error of {hardest} the usual pulses would take {times:.1f} times as long. {figure} shows the "
        "fin, the angle expected inside its limits, and the track; the CSV beside it is what the vehicle is sent."
    )


def _report_inspect(_result: Result) -> Report:
    return "degrees under the logger's own names; a mapping is proposed", (
        "The logger writes degrees under names of its own. The proposed mapping says which column is which signal and in which "
        "unit; look it over, then import with it."
    )


def _report_import(result: Result) -> Report:
    means = "Each log is now a run: SI and radians, headings unwrapped, one clock. From here on no command needs the mapping."
    return f"{len(result['runs'])} runs: SI and radians, one clock", means


def _report_identify(result: Result) -> Report:
    fits = result["fits"]
    name = next(iter(fits[0]["parameters"]))
    values = ((f["speed_m_s"], f["parameters"][name]) for f in fits)
    parts = "; ".join(f"{number(speed, 2)} m/s: {with_error(p['value'], p['std_error'])}" for speed, p in values)
    brief, verdict = _error_over_noise(fits)
    return brief, f"{name} over speed is {parts} 1/s. {verdict}"


def _report_joint_fit(result: Result) -> Report:
    brief, verdict = _error_over_noise(result["fits"])
    speeds = len(result["fits"][0]["runs"])
    means = f"One model for {speeds} speeds: damping shared, authority by speed. {verdict} Its judge are runs it has not seen."
    return brief, means


def _error_over_noise(fits: Sequence[Result]) -> Report:
    """Return the error of fits over the sensors' noise in words, and its meaning."""
    left = max(over_noise(f, f["noise_floor"]) for f in fits)
    brief = f"{len(fits)} model{'s' * (len(fits) > 1)}, what is left is {left:.1f} x the sensors' noise"
    if is_noise(left):
        return brief, f"What is left is {left:.2f} x the sensors' noise: nothing more to explain."
    return brief, f"What is left is {left:.1f} x the sensors' noise: the model's form, not its numbers, lacks something."


def _report_compare(result: Result) -> Report:
    run = max(result["runs"], key=lambda r: float(r["over_noise"]))
    brief = f"{run['run']}: error {run['over_noise']:.2f} x the noise"
    opening = f"On {run['run']}, which the fit has not seen, the {_channel_fits(run)}. "
    if not run["failing"]:
        return f"{brief}: nothing is left", f"{opening}That is the noise: here the model lacks nothing."
    worst = run["where"][0]
    return f"{brief}, most of it at `{worst['condition']}`", (
        f"{opening}{100 * worst['share_of_error']:.0f} % of the {run['judged_by']}'s squared error falls on "
        f"`{worst['condition']}` ({worst['rms_ratio']:.1f} x the run's own rms, worst from {worst['t_start_s']:.1f} to "
        f"{worst['t_end_s']:.1f} s): that is where to look for what the model lacks."
    )


def _report_compare_again(result: Result) -> Report:
    fits = "; ".join(f"on {run['run']} the {_channel_fits(run)}" for run in result["runs"])
    return _report_compare(result)[0], f"The same runs again, now with the effect: {fits}."


def _channel_fits(run: Result) -> str:
    """Return the fit of each channel and its error over its noise, the worse channel first."""
    over = run["over_floor"].items()
    return " and the ".join(f"{n} fit is {number(run[f'{n}_fit_percent'], 3)} % ({x:.1f} x its noise)" for n, x in over)


def _report_diagnosis(result: Result) -> Report:
    verdict, named = result["verdict"], result["effects"]
    if not named:
        means = f"The verdict is {verdict}: no effect of the catalogue is named, and none is added below."
        return f"{verdict}: no effect is named", means
    first = result["candidates"][0]
    sure = f"probability {number(first['probability'], 3)}"
    return f"{' and '.join(named)}, {sure}", (
        f"Every effect of the catalogue was added in turn and judged on runs it had not seen: {first['effect']} has {sure} and "
        f"explains {100 * first['explained']:.0f} % of what the noise does not."
    )


def _named_effects(result: Result) -> Mapping[str, str]:
    return {"effects": ",".join(result["effects"])} if result["effects"] else {}


def _report_extension(result: Result) -> Report:
    before, after = (f"{result['over_floor'][when]:.2f}" for when in ("before", "after"))
    brief = f"error on unseen runs {before} -> {after} x the noise, {'kept' if result['kept'] else 'not kept'}"
    if not result["kept"]:
        return (
            brief,
            f"On runs not seen the error goes from {before} to {after} x the noise: it does not pay, so nothing is kept.",
        )
    left = f"something is left to find: `{result['next']}`" if result["left"]["more_than_noise"] else "nothing is left to find"
    means = f"On runs not seen the error falls from {before} to {after} x the noise. 1 is where the sensors end, so {left}."
    return brief, means


def _extended_model(result: Result) -> Mapping[str, str]:
    return {"extended": str(result["model"])}


def _report_history(result: Result) -> Report:
    return f"parent, data and error of each step; drawn in {result['figure']}", (
        "Each model knows its parent, its data by their hash, and the error before and after: "
        f"the figure shows it falling to the noise floor, {result['figure']}."
    )


def _report_refit(result: Result) -> Report:
    fits = result["fits"]
    name = next(iter(fits[0]["parameters"]))
    errors = {f["run"]: 100.0 * abs(p["std_error"] / p["value"]) for f in fits for p in [f["parameters"][name]]}
    accuracy = {run: f"{error:.1f} %" for run, error in errors.items() if run.startswith("learn")}
    planned = accuracy.pop(f"learn_{SPEED:.1f}")
    return f"{len(fits)} speeds, {name} to {max(errors.values()):.1f} % or better", (
        "With the effect in the model every run may be fitted, those that judged too, which gives two more speeds. The planned "
        f"run tells {name} to {planned}, the other two to {' and '.join(accuracy.values())}. {_error_over_noise(fits)[1]}"
    )


def _new_fits(result: Result) -> Mapping[str, str]:
    return {"fits": str(Path(result["fits"][0]["model"]).parent / "*.yaml")}


def _report_laws(result: Result) -> Report:
    powers = {name: law["exponent"] for name, law in result["laws"].items() if law.get("exponent")}
    brief = ", ".join(f"|{name}| as u^{power['value']:.2f}" for name, power in powers.items())
    growth = "; ".join(f"|{name}| grows as {power['says']}" for name, power in powers.items())
    means = f"{growth or 'Each parameter has its law over speed'}. The laws carry the model to speeds that were not flown."
    return brief or "a law for each parameter", means


def _report_turns(result: Result) -> Report:
    tightest = min(result["rows"], key=lambda row: float(row["radius_m"]))
    radius, speed, (low, high) = float(tightest["radius_m"]), f"{number(tightest['speed_m_s'], 2)} m/s", tightest["interval95"]
    brief = f"{number(radius, 3)} m at {speed}, 95 % {number(low, 3)} .. {number(high, 3)} m, {tightest['trust']}"
    turn = turn_words(radius, tightest["interval95"], f"at {speed} to {tightest['side']}")
    shows = "what was flown may never show a settled turn, and a wide band says so."
    return brief, f"The tightest turn is {turn}, and it is {tightest['trust']}: {shows}"


def _report_schedule(result: Result) -> Report:
    ends = [(r["kp"], f"{number(r['speed_m_s'], 2)} m/s") for r in (result["rows"][0], result["rows"][-1])]
    brief, sizes = (" to ".join(f"{number(size(kp), 2)} at {speed}" for kp, speed in ends) for size in (float, abs))
    return f"kp {brief}", (
        f"kp goes from {sizes}, so that all speeds settle alike with no more fin than that takes; the feed-forward holds the "
        "fin's own trim."
    )


def _report_verification(result: Result) -> Report:
    ours, constant = (max(float(c["settling_s"]) for c in result[part]) for part in ("scheduled", "constant"))
    fin, its = (100.0 * result[part][-1]["fin_use"] for part in ("scheduled", "constant"))
    margin = f"{result['worst']['phase_margin_deg']:.0f} deg"
    return f"least phase margin {margin}, a heading step settles within {ours:.0f} s", (
        f"The least phase margin over speeds and errors is {margin}. A heading step settles "
        f"within {ours:.0f} s at every speed, with one constant gain within {constant:.0f} s; at the highest speed it asks for "
        f"{fin:.0f} % of the fin, with one constant gain for {its:.0f} %."
    )


def _report_export(_result: Result) -> Report:
    return "ROS 2 parameters", (
        "Flat arrays of equal length, a decimal point in every number: a ROS 2 node loads them as they are. `--into` puts them "
        "into a configuration file you already have, and shows the difference first."
    )


def _report_page(result: Result) -> Report:
    return f"{result['file']}: open it in a browser", (
        f"{result['file']} is one page of {result['bytes'] / 1e6:.1f} MB that needs no network: verdicts first, then "
        f"{result['figures']} figures to zoom and read off, every number, what was made from what, and how to repeat it."
    )


PLAN = Step(
    "What to fly?",
    f"plan --axis {{axis}} --speeds {SPEED} --fin-rate {LIMITS.fin_rate:g} --write csv -o {{plan}}",
    _report_plan,
)
STEPS: tuple[Step, ...] = (
    Step("What is in the log?", "inspect {trial}/learn_1.4.csv --write-mapping {mapping}", _report_inspect),
    Step("From log to run", "import {trial}/*.csv --mapping {mapping} -o {runs}", _report_import),
    Step(
        "A model for each speed",
        "identify {runs}/learn_*.parquet --axis {axis} -o {models} --no-figures",
        _report_identify,
    ),
    Step(
        "One model for all speeds",
        "identify {runs}/learn_*.parquet --axis {axis} --joint -o {models} --no-figures",
        _report_joint_fit,
    ),
    Step(
        "Does it hold on runs it has not seen?",
        "compare {models}/joint_{axis}.yaml {runs}/check_*.parquet -o {models}",
        _report_compare,
    ),
    Step(
        "Which physical effect is missing?",
        f"diagnose {{runs}}/learn_*.parquet --axis {{axis}} {CHECKED} -o {{models}}/diagnosis.yaml "
        "--figure {models}/diagnosis.png",
        _report_diagnosis,
        learns=_named_effects,
    ),
    Step(
        "Add it, and watch the error fall",
        f"extend {{models}}/joint_{{axis}}.yaml {{runs}}/learn_*.parquet --add {{effects}} {CHECKED}",
        _report_extension,
        learns=_extended_model,
    ),
    Step("How did this model come about?", "history {extended} --figure {models}/history.png", _report_history),
    Step("Does it hold now?", "compare {extended} {runs}/check_*.parquet -o {final}", _report_compare_again),
    Step(
        "A better model for each speed",
        "identify {runs}/*.parquet --axis {axis} --effects {effects} -o {final}/speeds --no-figures",
        _report_refit,
        learns=_new_fits,
    ),
    Step("How do the numbers change with speed?", "fit {fits} -o {final}/law_{axis}.yaml", _report_laws),
    Step("How tight does it turn?", "turn-radius {fits} --speeds 1.0,1.4,1.8 -o {turning}", _report_turns, (Axis.YAW,)),
    Step(
        "Gains for every speed",
        "schedule design {fits} --fin-max 0.26 -o {turning}/gains.yaml",
        _report_schedule,
        (Axis.YAW,),
    ),
    Step(
        "Are they good, also between the speeds?",
        "schedule verify {turning}/gains.yaml --require-phase-margin 30 -o {turning}/gains.png",
        _report_verification,
        (Axis.YAW,),
    ),
    Step(
        "Into the vehicle",
        "schedule export {turning}/gains.yaml --to ros2 -o {turning}/heading_ros2.yaml",
        _report_export,
        (Axis.YAW,),
    ),
    Step("All of it in one file", "report {folder}", _report_page),
)
