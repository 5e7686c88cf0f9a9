"""What the commands' pages run: for each command its lines, what each shows, and how much of what it says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from guide.sameness import ELIDED
from guide.session import SWAPPED, TOUR

LEARN, CHECK = "demo/runs/learn_*.parquet", ("demo/runs/check_1.2.parquet", "demo/runs/check_1.6.parquet")
JOINT, LAGGED = "demo/models/joint_yaw.yaml", "demo/models/joint_yaw+servo_lag.yaml"
CHECKED = " ".join(f"--validate {run}" for run in CHECK)
SPEEDS, GAINS = "demo/final/speeds/*.yaml", "demo/turning/gains.yaml"


@dataclass(frozen=True)
class Example:
    """A command line, what it shows, and the lines kept of what it says, at its start and its end; all where both are zero."""

    says: str
    line: str
    head: int = 0
    tail: int = 0

    def kept(self, said: str) -> str:
        """Return what is shown of what it says."""
        lines = said.splitlines()
        if not self.head + self.tail or len(lines) <= self.head + self.tail + 1:
            return said
        return "\n".join([*lines[: self.head], ELIDED, *lines[len(lines) - self.tail :]])


EXAMPLES: Mapping[str, tuple[Example, ...]] = {
    "init": (
        Example("A folder for a trial.", "sysid init pandan"),
        Example(
            "The vehicle's limits are stated there once; every command run in that folder finds them.", "cat pandan/vehicle.yaml"
        ),
    ),
    "status": (
        Example("What there is, what follows from what, and what comes next.", "sysid status demo"),
        Example("Of a new trial.", "sysid status pandan"),
    ),
    "report": (Example("Everything of a folder in one file.", "sysid report demo"),),
    "plan": (
        Example(
            "What to fly at one speed, as a logger of commands takes it.",
            "sysid plan --axis yaw --speeds 1.4 --fin-rate 1.5 --write csv -o demo/plan",
        ),
        Example("What would tell two effects apart.", "sysid plan --axis yaw --separate servo_lag,delay"),
    ),
    "inspect": (
        Example(
            "A text table in degrees, under names of the logger's own.",
            "sysid inspect demo/trial/learn_1.4.csv --write-mapping demo/mapping.yaml",
        ),
    ),
    "import": (
        Example("With the mapping looked over.", "sysid import demo/trial/*.csv --mapping demo/mapping.yaml -o demo/runs"),
    ),
    "identify": (
        Example("A model of each run.", f"sysid identify {LEARN} --axis yaw -o demo/models --no-figures"),
        Example(
            "One model of all runs: damping and trim shared, authority by speed.",
            f"sysid identify {LEARN} --axis yaw --joint -o demo/models --no-figures",
        ),
        Example(
            "With an effect in the model.",
            "sysid identify demo/runs/*.parquet --axis yaw --effects servo_lag -o demo/final/speeds --no-figures",
            head=17,
            tail=13,
        ),
        Example(
            "The recursive estimate as it is made on board; the figure shows it over time.",
            "sysid identify demo/runs/learn_1.4.parquet --axis yaw --method svf_rls -o demo/recursive",
        ),
    ),
    "live": (
        Example(
            "A log replayed without waiting, one look every 10 s; on a terminal it is one table that changes.",
            "sysid live demo/runs/learn_1.4.parquet --axis yaw --speed 0 --every 10",
        ),
        Example(
            "Lines as a vehicle sends them, up to the moment when there is enough.",
            'tail -n +2 demo/trial/learn_1.4.csv | head -2; printf \'{"time_s": 0, "rudder_deg": 5, "yaw_deg": 91}\\n\' '
            "| sysid live - --axis yaw",
        ),
    ),
    "compare": (
        Example(
            "On runs the fit has not seen.", f"sysid compare {JOINT} demo/runs/check_*.parquet -o demo/models", head=18, tail=3
        ),
        Example(
            "As a gate: the exit code is 1 where a fit is below it.",
            f'sysid compare {JOINT} {CHECK[1]} --min-fit 95 --top 2; echo "exit code $?"',
        ),
        Example(
            "Two models over the same runs, one extended from the other: how the error fell, and the loop in one picture.",
            f"sysid compare {JOINT} {LAGGED} demo/runs/check_*.parquet -o demo/figures",
        ),
        Example("Before and after a swap, here of a payload that costs the rudder 18 % of its authority.", SWAPPED),
    ),
    "simulate": (
        Example(
            "A zig-zag that was not flown, with the sensors' noise.",
            f"sysid simulate {LAGGED} --maneuver zigzag:amplitude=15deg --speed 1.4 --noise 1 -o demo/zigzag.csv",
        ),
        Example("The run has the canonical columns, and every command reads it.", "head -3 demo/zigzag.csv"),
    ),
    "diagnose": (
        Example(
            "Fitted to three runs, judged by two others.",
            f"sysid diagnose {LEARN} --axis yaw {CHECKED} -o demo/models/diagnosis.yaml --figure demo/models/diagnosis.png",
        ),
        Example(
            "The same, from a model that has the effect already.",
            f"sysid diagnose {LEARN} --axis yaw --model {LAGGED} {CHECKED}",
            head=12,
            tail=1,
        ),
    ),
    "extend": (
        Example("An addition that pays.", f"sysid extend {JOINT} {LEARN} --add servo_lag {CHECKED}"),
        Example("One that does not, and is not kept.", f"sysid extend {LAGGED} {LEARN} --add quadratic_damping {CHECKED}"),
        Example("Its parent again.", f"sysid extend {LAGGED} --undo"),
    ),
    "history": (Example("From the first model to this one.", f"sysid history {LAGGED} --figure demo/models/history.png"),),
    "effects": (
        Example("The whole catalogue.", "sysid effects list", head=12, tail=7),
        Example("One effect.", "sysid effects show servo_lag"),
        Example(
            "A start for one of your own.",
            "mkdir own && cd own && sysid effects new tether_drag && sysid effects show tether_drag",
        ),
    ),
    "fit": (
        Example("The laws that carry a model from speed to speed.", f"sysid fit {SPEEDS} -o demo/final/law_yaw.yaml"),
        Example(
            "From a table, here on standard input.",
            "printf 'speed_m_s,b2\\n1.0,-0.55\\n1.5,-0.97\\n2.0,-1.53\\n2.5,-2.28\\n' | sysid fit -",
        ),
    ),
    "turn-radius": (
        Example("Simulated to the settled circle.", f"sysid turn-radius {SPEEDS} --speeds 1.0,1.4,1.8 -o demo/turning"),
        Example(
            "Beside a circle that was flown, with positions in its log.",
            f"sysid turn-radius {SPEEDS} --speeds 1.4 --fin-max 0.26 --measured circle.csv",
        ),
        Example(
            "By the u-turn formula, from a table.",
            "printf 'speed_m_s,a22,b2\\n1.5,1.0,-0.97\\n' | sysid turn-radius - --fin-max 0.26",
        ),
    ),
    "schedule": (
        Example("Gains for each model's speed.", f"sysid schedule design {SPEEDS} --fin-max 0.26 -o {GAINS}"),
        Example(
            "Margins and steps over the identified set, also between the speeds.",
            f"sysid schedule verify {GAINS} --require-phase-margin 30 -o demo/turning/gains.png",
        ),
        Example("In the vehicle's own format.", f"sysid schedule export {GAINS} --to dune"),
    ),
    "batch": (
        Example("The runs of a trial.", "sysid batch demo/runs/*.parquet --axis yaw -o demo/batch --no-diagnose --workers 1"),
        Example(
            "Once more: what is known is not asked again.",
            "sysid batch demo/runs/*.parquet --axis yaw -o demo/batch --no-diagnose --workers 1 --trend",
        ),
    ),
    "demo": (Example("The tour with all that its commands say, here its first two steps and its end.", TOUR, head=58, tail=13),),
    "guide": (
        Example("One page.", "sysid guide schemas/init | head -20"),
        Example("A mistyped topic.", 'sysid guide sevo_lag; echo "exit code $?"'),
    ),
}

MORE: tuple[str, ...] = (
    "sysid identify demo/runs/learn_1.4.parquet --axis yaw -o demo/one",
    "sysid simulate pitch.yaml --maneuver square_pulses --noise 2 -o pitch.csv",
    "sysid identify pitch.csv --axis pitch",
    "sysid schedule export demo/turning/gains.yaml --into config.yaml --key control.heading",
    "sysid guide",
    "sysid guide limits",
)
"""Lines that no page shows; the figures or the schemas need what they give."""
