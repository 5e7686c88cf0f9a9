"""Progress where standard error is no terminal: a line every few seconds, so that a log of it says the work goes on."""

from __future__ import annotations

import pytest

from fieldsid.cli.progress import LINE_EVERY_S, _throttled, trying
from fieldsid.cli.voice import take


def test_a_line_is_shown_no_more_often_than_every_few_seconds():
    now, shown = [0.0], []
    told = _throttled("diagnosing", shown.append, lambda: now[0])
    for second in range(int(3 * LINE_EVERY_S) + 1):
        now[0] = float(second)
        told(f"set {second}")
    assert shown == ["diagnosing: set 5", "diagnosing: set 10", "diagnosing: set 15"]


@pytest.mark.parametrize(("words", "said"), [([], "extending: servo_lag\n"), (["--quiet"], "")])
def test_a_quiet_command_shows_none(capsys, monkeypatch, words, said):
    take(["extend", *words])
    monkeypatch.setattr("fieldsid.cli.progress.LINE_EVERY_S", 0.0)
    with trying("extending") as told:
        told("servo_lag")
    take(["extend"])
    assert capsys.readouterr().err == said
