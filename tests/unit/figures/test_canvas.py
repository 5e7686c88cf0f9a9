"""A figure is written as what its name says, and the same figure is always the same file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fieldsid.errors import UsageError
from fieldsid.figures import canvas
from fieldsid.figures.kinds import KINDS

FIRST = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF-"}
DRAWN = """
import sys
from pathlib import Path
import numpy as np
from fieldsid.figures import canvas
x = np.linspace(0.0, 1.0, 50)
def draw(ax):
    canvas.dress(ax, x="time [s]", y="rate", title="rate")
    canvas.dots(ax, x, x**2)
    ax.plot(x, x**3, label="model")
    ax.fill_between(x, x, x**2, hatch="//", clip_on=True)
    canvas.legend_above(ax, 80)
sheet = canvas.sheet(8.0, 5.0)
draw(sheet.add_subplot())
for suffix in sys.argv[2:]:
    canvas.save(sheet, Path(sys.argv[1]) / f"f{suffix}")
"""


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the folders of what two processes write, each with hashes of its own."""
    folders = tmp_path_factory.mktemp("one"), tmp_path_factory.mktemp("other")
    for seed, folder in enumerate(folders, 1):
        environment = {"PYTHONHASHSEED": str(seed), "PYTHONPATH": str(Path(canvas.__file__).parents[2])}
        subprocess.run([sys.executable, "-c", DRAWN, folder, *FIRST], check=True, env=environment)
    return folders


@pytest.mark.parametrize("suffix", FIRST)
def test_the_suffix_is_the_kind_of_file_and_the_same_figure_the_same_bytes(drawn, suffix):
    one, other = ((folder / f"f{suffix}").read_bytes() for folder in drawn)
    assert one.startswith(FIRST[suffix])
    assert one == other
    assert b"CreationDate" not in one
    assert b"<dc:date>" not in one


def test_capital_letters_are_a_suffix_too(tmp_path):
    sheet = canvas.sheet(9.0, 7.0)
    sheet.add_subplot()
    path = canvas.save(sheet, tmp_path / "F.SVG")
    assert path.read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize("name", ["f.jpg", "f", "f.", "f.png.txt"])
def test_another_suffix_is_refused_with_one_that_is_drawn(tmp_path, name):
    with pytest.raises(UsageError) as caught:
        canvas.save(canvas.sheet(9.0, 7.0), tmp_path / name)
    assert list(tmp_path.iterdir()) == []
    assert all(f".{kind}" in caught.value.hint for kind in KINDS)


def test_a_long_title_goes_on_in_another_line_within_the_sheet():
    title = "run, yaw: " + ", ".join(f"parameter{k} = 0.84000000 +/- 0.00000006 1/s" for k in range(5)) + "\nflown at 1.40 m/s"
    sheet = canvas.sheet(9.0, 8.0, title)
    sheet.draw_without_rendering()
    assert sheet.get_suptitle().endswith("\nflown at 1.40 m/s")
    assert sheet.texts[0].get_window_extent().x1 <= sheet.bbox.x1
    assert "+/-\n" not in sheet.get_suptitle()
