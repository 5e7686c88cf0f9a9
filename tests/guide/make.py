"""All that is generated of the guide: `.ci/docs` writes it, the tests compare it with what is there."""

from __future__ import annotations

from pathlib import Path

from guide import command_pages, effect_pages, reference_pages, schema_pages
from guide.blocks import YAML_FILE, filled
from guide.examples import EXAMPLES, MORE
from guide.pictures import WHOLE, alike, part_of
from guide.sameness import same
from guide.session import Session, begun

GUIDE = Path(__file__).resolve().parents[2] / "fieldsid" / "guide"
WRITTEN = ("index.md", "trial.md", "theory.md", "figures.md", "python.md", "extending.md", "limits.md", "measured.md")
"""Pages written by hand; what their command lines say is filled in."""
EXACT = ("effects", "schemas")
"""Folders whose pages hold nothing that was computed."""
FIGURES: dict[str, tuple[str, float, tuple[float, float, float, float]]] = {
    "plan": ("demo/plan/plan.png", 0.6, WHOLE),
    "identify": ("demo/one/learn_1.4_yaw.png", 0.54, WHOLE),
    "recursive": ("demo/recursive/learn_1.4_yaw_over_time.png", 0.62, WHOLE),
    "compare": ("demo/models/joint_yaw_on_check_1.6.png", 0.62, (0.0, 0.05, 0.625, 1.0)),
    "where": ("demo/models/joint_yaw_on_check_1.6.png", 0.62, (0.64, 0.05, 1.0, 1.0)),
    "loop": ("demo/figures/loop.png", 0.5, WHOLE),
    "diagnose": ("demo/models/diagnosis.png", 0.62, WHOLE),
    "history": ("demo/models/history.png", 0.75, WHOLE),
    "law": ("demo/final/law_yaw.png", 0.7, WHOLE),
    "turn_radius": ("demo/turning/turn_radius.png", 0.7, WHOLE),
    "schedule": ("demo/turning/gains.png", 0.5, WHOLE),
}
"""Figures of the page on figures: the file a command drew, the scale, and the part of it that is shown."""


def everything_run(folder: Path) -> Session:
    """Return a session in which every line of the commands' pages was run."""
    session = begun(folder)
    for block in YAML_FILE.finditer((GUIDE / "extending.md").read_text()):
        path = folder / "mine" / block["path"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.group())
    for line in (*(e.line for of in EXAMPLES.values() for e in of), *MORE):
        session.run(line)
    return session


def generated(session: Session) -> dict[str, str | bytes]:
    """Return every generated file of the guide by its path, pages as text and figures as bytes."""
    effects = session.body("sysid effects list")["effects"]
    folders = {
        "effects": effect_pages.pages(effects),
        "commands": command_pages.pages(session),
        "schemas": schema_pages.pages(),
        "figures": pictures(session),
    }
    made = {f"{folder}/{name}": body for folder, files in folders.items() for name, body in files.items()}
    return made | dict(reference_pages.pages())


def pictures(session: Session) -> dict[str, bytes]:
    """Return the figures that the session's commands drew, made small, by path below `figures/`."""
    return {f"{name}.png": picture(name, session) for name in FIGURES}


def picture(name: str, session: Session) -> bytes:
    """Return one of them."""
    file, scale, box = FIGURES[name]
    return part_of((session.folder / file).read_bytes(), scale, box)


def write(session: Session) -> None:
    """Write the generated files, take away those that are generated no more, and fill in the pages written by hand."""
    made = generated(session)
    for folder in {name.partition("/")[0] for name in made if "/" in name}:
        for old in (GUIDE / folder).glob("*"):
            if f"{folder}/{old.name}" not in made:
                old.unlink()
    for name, body in made.items():
        path = GUIDE / name
        path.parent.mkdir(exist_ok=True)
        if not (path.exists() and is_current(path, body)):
            path.write_bytes(body.encode() if isinstance(body, str) else body)
    for name in WRITTEN:
        path = GUIDE / name
        text = filled(path.read_text(), session.run)
        if not is_current(path, text):
            path.write_text(text)


def is_current(path: Path, body: str | bytes) -> bool:
    """Whether a file holds what is generated now, but for rounding and run times in what commands say."""
    if isinstance(body, bytes):
        return alike(path.read_bytes(), body)
    was, folder = path.read_text(), path.relative_to(GUIDE).parts[0]
    return was == body or (folder not in EXACT and same(was, body))
