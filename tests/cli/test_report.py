"""`sysid report`: one page from a trial's files, whole by itself, and what a browser makes of it where one is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from cli import trial

from fieldsid.models.axis import Axis
from fieldsid.reporting.pdf import browser

VOID = {"meta", "link", "br", "hr", "input", "img"}
needs_browser = pytest.mark.skipif(browser() is None, reason="no browser that prints is installed")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A trial with runs, models, a diagnosis, gains and a turning radius, and its report."""
    from contextlib import chdir

    from fieldsid.cli.app import main

    folder = tmp_path_factory.mktemp("report") / "pandan"
    assert main(["init", str(folder)]) == 0
    for speed in (1.0, 1.4):
        trial.flown(folder / "runs", speed=speed, name=f"pulses_{speed}")
    with chdir(folder):
        (folder / "notes.md").write_text('wind 3 bft, <swell> & "salt"\n')
        assert main(["identify", "--axis", "yaw", "--joint", "--no-figures"]) == 0
        trial.flown(folder / "runs", spec="zigzag", name="zigzag")
        assert main(["diagnose", "--axis", "yaw"]) == 0
        assert main(["turn-radius", "--speeds", "1.0,1.4", "-o", "turning", "--no-figures"]) == 0
        assert main(["schedule", "design", "-o", "gains.yaml"]) == 0
        assert main(["report"]) == 0
    return folder


class Outline(HTMLParser):
    """What a page is made of: whether its elements close, its ids, links, and addresses of other files."""

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.links, self.outside = [], set(), set(), []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        self.ids.add(given.get("id"))
        if tag == "a":
            self.links.add(given["href"])
        self.outside += [v for k, v in attrs if k in ("src", "srcset", "data", "poster") or (tag == "link" and k == "href")]

    def handle_startendtag(self, _tag, _attrs):
        """Nothing stays open."""

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_whole_small_and_asks_for_nothing_else(made):
    text = (made / "report.html").read_text()
    page = Outline()
    page.feed(text)
    assert page.open == []
    assert page.outside == []
    assert {link.removeprefix("#") for link in page.links} <= page.ids
    assert len(text.encode()) < 3_000_000
    assert "@import" not in text
    assert "url(" not in text
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text)


def test_it_says_verdicts_first_and_then_every_part(made):
    text = (made / "report.html").read_text()
    heads = re.findall(r"<h2>(.*?)</h2>", text)
    assert heads[0] == "Verdicts"
    assert heads[-4:] == ["Runs", "What was made from what", "Commands", "Notes"]
    assert {"Yaw: effects tried", "Turning radius", "Yaw: gains and margins"} <= set(heads)
    assert "&lt;swell&gt; &amp; &#34;salt&#34;" in text
    assert "sysid identify --axis yaw --joint --no-figures runs/pulses_1.0.parquet runs/pulses_1.4.parquet -o models" in text


def test_the_page_does_not_name_itself_as_the_next_step(made):
    from fieldsid.reporting.material import material_of
    from fieldsid.reporting.sections import context_of
    from fieldsid.trial_folder.next_step import REPORT
    from fieldsid.trial_folder.state import state_of

    material = material_of(state_of(made))
    said = [
        context_of(replace(material, next_step=("why", command)))["next"]["command"]
        for command in (REPORT, "sysid schedule verify")
    ]
    assert said == ["", "sysid schedule verify"]


def test_every_run_has_its_figure_without_a_script(made):
    text = (made / "report.html").read_text()
    figures = re.findall(r'<figure class="pair".*?</figure>', text, re.DOTALL)
    assert [re.search(r'data-run="(.*?)"', f)[1] for f in figures] == ["pulses_1.0", "pulses_1.4", "zigzag"]
    assert all(f.count("<polyline") >= 4 for f in figures)
    assert 'hidden data-axis="yaw"' in text  # the choice needs the script, and shows with it


def test_what_exists_is_not_replaced_and_json_says_what_is_in_it(run_cli, made, monkeypatch):
    monkeypatch.chdir(made)
    assert run_cli("report").code == 2
    body = run_cli("report", "--force", "--json").json
    assert body["schema"] == "fieldsid/report/1"
    assert body["runs"] == ["pulses_1.0", "pulses_1.4", "zigzag"]
    assert body["models"] == ["models/joint_yaw.yaml"]
    assert body["bytes"] == (made / "report.html").stat().st_size
    assert body["verdicts"][0]["what"] == "yaw model"
    assert re.match(r"on 1 run it was not fitted to: zigzag: error [\d.]+ x the noise, rate fit", body["verdicts"][0]["says"])


def test_files_given_one_by_one_are_all_that_is_in_it(run_cli, made, tmp_path):
    model, run = made / "models" / "joint_yaw.yaml", made / "runs" / "zigzag.parquet"
    body = run_cli("report", model, run, "-o", tmp_path / "r.html", "--json").json
    assert (body["models"], body["runs"]) == (["models/joint_yaw.yaml"], ["zigzag"])
    assert "<h2>Turning radius" not in (tmp_path / "r.html").read_text()


def test_a_run_that_cannot_be_used_is_said_and_the_rest_stands(run_cli, made, tmp_path):
    copy = shutil.copytree(made, tmp_path / "copy")
    (copy / "runs" / "broken.csv").write_text("time_s,yaw_rad\n0,0\n0.1,x\n")
    answer = run_cli("report", copy, "--force")
    assert answer.code == 0
    assert "broken" in answer.err
    assert "Not in this report" in (copy / "report.html").read_text()


def test_a_run_that_excites_the_other_plane_alone_says_nothing_for_a_model(run_cli, made, tmp_path):
    copy = shutil.copytree(made, tmp_path / "copy")
    trial.flown(copy / "runs", Axis.PITCH, name="stairs")
    body = run_cli("report", copy, "--force", "--json").json
    assert body["runs"] == ["pulses_1.0", "pulses_1.4", "stairs", "zigzag"]
    assert "on 1 run it was not fitted to" in body["verdicts"][0]["says"]


@pytest.mark.parametrize(
    ("asked", "says"),
    [(("nowhere",), "is not there"), ((".", "-o", "r.txt"), "HTML or PDF"), ((".",), "nothing to report")],
)
def test_what_makes_no_report_is_said(run_cli, tmp_path, monkeypatch, asked, says):
    monkeypatch.chdir(tmp_path)
    answer = run_cli("report", *asked)
    assert answer.code == 2
    assert says in answer.err
    assert list(tmp_path.iterdir()) == []


def test_a_pdf_without_a_browser_is_refused_before_the_work(run_cli, made, monkeypatch, tmp_path):
    monkeypatch.setattr("fieldsid.reporting.pdf.browser", lambda: None)
    answer = run_cli("report", made, "-o", tmp_path / "r.pdf")
    assert answer.code == 2
    assert "print it to a file" in answer.err


@needs_browser
def test_a_browser_prints_it(run_cli, made, tmp_path):
    assert run_cli("report", made, "-o", tmp_path / "r.pdf").code == 0
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF-")


def in_browser(folder, page, script, *, width=1000):
    """Open a page in a headless browser, run a script in it, and return what it wrote and the console's errors."""
    text = page.read_text().replace("</body>", f"<script>{script}</script></body>")
    (folder / "page.html").write_text(text)
    (folder / "frame.html").write_text(
        f"<iframe src='page.html' style='width:{width}px;height:900px'></iframe><script>addEventListener('message', "
        "e => { document.title = e.data; })</script>"
    )
    words = [
        browser(), "--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/profile",
        "--enable-logging=stderr", "--virtual-time-budget=4000", "--dump-dom", (folder / "frame.html").as_uri(),
    ]  # fmt: skip
    done = subprocess.run(words, capture_output=True, text=True, timeout=100, check=True)
    errors = [line for line in done.stderr.splitlines() if "CONSOLE" in line and "rror" in line]
    return re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)[1], errors


@needs_browser
def test_the_script_zooms_reads_off_and_chooses_by_keyboard(made, tmp_path):
    script = """
    const key = (k, on) => on.dispatchEvent(new KeyboardEvent("keydown", {key: k, bubbles: true, cancelable: true}));
    const svg = document.querySelector("svg.chart"), panel = svg.querySelector("svg.panel");
    const whole = panel.getAttribute("viewBox");
    key("ArrowRight", svg);
    const read = svg.nextElementSibling.textContent;
    key("+", svg);
    const zoomed = panel.getAttribute("viewBox") !== whole;
    key("Escape", svg);
    const back = panel.getAttribute("viewBox").split(" ").map(Number).join() === whole.split(" ").map(Number).join();
    const shown = () => [...document.querySelectorAll("figure.pair")].filter(f => f.offsetHeight > 0).map(f => f.dataset.run);
    const first = shown(), run = document.querySelectorAll(".picker select")[1];
    run.value = "zigzag"; run.dispatchEvent(new Event("change"));
    parent.postMessage(JSON.stringify({read, zoomed, back, first, then: shown(), focus: svg.tabIndex}), "*");
    """
    said, errors = in_browser(tmp_path, made / "report.html", script)
    assert errors == []
    assert "&quot;" not in said
    assert re.search(r'"read":"time \d', said)
    assert '"zoomed":true,"back":true,"first":["pulses_1.0"],"then":["zigzag"],"focus":0' in said


@needs_browser
@pytest.mark.parametrize("width", [390, 1000])
def test_nothing_is_wider_than_the_page(made, tmp_path, width):
    script = """
    const long = "models/joint_yaw" + "+speed_varying".repeat(6);
    for (const select of document.querySelectorAll("select")) select.append(new Option(long, long));
    const wide = [...document.querySelectorAll("body *")].filter(e => !e.closest(".scroll") && !e.closest("svg")
        && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.tagName + "." + e.className);
    const text = document.querySelector("svg.chart text"), size = text.getBoundingClientRect().height;
    const scrolls = document.documentElement.scrollWidth > innerWidth;
    parent.postMessage(JSON.stringify({wide, readable: size >= 9, scrolls}), "*");
    """
    said, errors = in_browser(tmp_path, made / "report.html", script, width=width)
    assert errors == []
    assert said == '{"wide":[],"readable":true,"scrolls":false}'


def luminance(color):
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    return sum(
        w * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
        for w, c in zip((0.2126, 0.7152, 0.0722), parts, strict=True)
    )


def test_words_and_lines_stand_out_from_their_ground_in_light_dark_and_print():
    """Contrast by WCAG 2.1: 4.5 for words, 3 for lines of figures."""
    from fieldsid.templates import template_path

    sets = [
        dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", s))
        for s in re.findall(r":root \{(.*?)\}", (template_path("report") / "report.css").read_text())
    ]
    assert len(sets) == 3
    for colors in sets:
        for name, least in (
            ("ink", 4.5),
            ("quiet", 4.5),
            ("good", 3),
            ("warn", 3),
            ("measured", 3),
            ("simulated", 3),
            ("second", 4.5),
        ):
            for ground in ("ground", "soft") if least == 4.5 else ("ground",):
                a, b = sorted((luminance(colors[name]), luminance(colors[ground])))
                assert (b + 0.05) / (a + 0.05) >= least, (name, ground)
