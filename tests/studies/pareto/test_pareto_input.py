"""What a trade-off refuses, each in one sentence, before any motion is looked for."""

import pytest

from ocp import Interrupted
from studies.cli import main
from studies.common.configuration import toml_text
from studies.common.console import silent
from studies.common.exit_codes import ExitCode, StudyError
from studies.pareto import study_from
from studies.pareto.config import as_dictionary
from studies.pareto.truss import TrussFront
from studies.truss.search.best_law import best_law

TWO = ["peak-acceleration", "peak-force"]


def stated(objectives=TWO, **more):
    pareto = {"objectives": objectives, **more.pop("pareto", {})}
    return {"pareto": pareto, "duration": 6.0, "caps": {"jerk": "500/T^3"}, **more}


def test_a_study_is_made_again_from_what_it_says():
    import tomllib

    study = study_from(stated(pareto={"range": [0.2, 0.5], "points": 7}))
    assert as_dictionary(study_from(as_dictionary(study))) == as_dictionary(study)
    assert study_from(tomllib.loads(toml_text(as_dictionary(study)))) == study


@pytest.mark.parametrize(
    ("objectives", "limited", "least"),
    [
        (["peak-force", "time"], "time", "peak-force"),
        (["peak-force", "peak-acceleration"], "peak-acceleration", "peak-force"),
        (["energy", "peak-power"], "peak-power", "energy"),
        (["energy", "peak-jerk"], "peak-jerk", "energy"),
        (["time", "peak-jerk"], "peak-jerk", "time"),
    ],
)
def test_the_one_that_is_easy_to_limit_is_limited(objectives, limited, least):
    study = study_from(stated(objectives, duration=[5.0, 9.0], caps={"jerk": 3.0}))
    assert (study.pareto.limited, study.pareto.least) == (limited, least)
    assert study.truss.minimise == ({least: 1.0},)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"duration": 6.0}, "give two: --objectives"),
        (stated(["peak-force"]), "give two out of"),
        (stated("peak-force"), "give two out of"),
        (stated(["peak-force", "peak-force"]), "names peak-force twice"),
        (stated([*TWO, "energy"]), "sweep with the subject 'pareto truss'"),
        (stated(["peak-force", "peak-forse"]), "did you mean peak-force"),
        (stated(["energy", "peak-motor-load"]), "neither of which can be limited"),
        (stated(["time", "peak-jerk"]), "needs bounds"),
        (stated(["time", "peak-force"]), "needs bounds"),
        (stated(minimise="energy"), "remove minimise"),
        (stated(pareto={"points": 2}), "at least 3"),
        (stated(pareto={"range": [2, 1]}), "lower limit first"),
        (stated(pareto={"rnage": [1, 2]}), "did you mean pareto.range"),
        (
            stated(["time", "energy"], duration=[5, 9], caps={}, pareto={"range": [5, 6]}),
            "remove one of them",
        ),
    ],
)
def test_what_cannot_be_asked_is_refused(raw, words):
    with pytest.raises(StudyError, match=words):
        study_from(raw)


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (
            [
                "--objectives",
                "peak-acceleration,peak-force",
                "--duration",
                "6",
                "--jerk-cap",
                "0.1",
            ],
            3,
            "raise the cap to at least 32 D/T^3",
        ),
        (
            [
                "--objectives",
                "peak-acceleration,peak-force",
                "--range",
                "0.01..0.5",
                "--duration",
                "6",
                "--jerk-cap",
                "500/T^3",
            ],
            3,
            "no motion deploys in 6 s under the caps on acceleration",
        ),
        (["--objective", "energy"], 2, "unknown flag --objective; did you mean --objectives?"),
    ],
)
def test_the_command_refuses_what_has_no_front(words, code, sentence, capsys, tmp_path):
    folder = tmp_path / "none"
    assert main(["pareto", "truss", *words, "--results", str(folder)]) == code
    assert sentence in capsys.readouterr().err
    assert not folder.exists()


@pytest.mark.parametrize(
    ("objectives", "caps", "open_ends"),
    [
        # 12.2884 N as of the study of the truss, whose motion would rest where nothing holds it
        (TWO, {}, {"peak-force": 12.2884}),
        (TWO, {"jerk": "500/T^3"}, {}),
        # the mean speed of 6.60987 m of rope, without jumps
        (["peak-rope-speed", "peak-reaction"], {}, {"peak-rope-speed": 6.60987 / 6}),
    ],
)
def test_a_least_value_that_no_motion_attains_is_an_open_end(objectives, caps, open_ends):
    subject = TrussFront(study_from(stated(objectives, caps=caps)), silent())
    subject.check()
    found = {name: limit.value for name, limit in subject.open_ends.items()}
    assert found == pytest.approx(open_ends, rel=1e-5)


def test_a_search_that_fails_beside_an_open_end_names_what_closes_it(monkeypatch):
    def failed(*given, **named):
        raise StudyError("no motion was found", ExitCode.NOT_SOLVED)

    monkeypatch.setattr("studies.pareto.truss.best_law", failed)
    study = study_from(stated(["peak-rope-speed", "peak-reaction"], caps={}))
    words = "^no motion was found; or cap the rope's acceleration$"
    with pytest.raises(StudyError, match=words) as raised:
        next(TrussFront(study, silent()).ends())
    assert raised.value.exit_code is ExitCode.NOT_SOLVED


def test_ends_are_not_solved_to_their_last_digits(monkeypatch):
    """They only begin a front; where the optimum is flat its last digits take most of the time."""
    asked = []

    def noted(*, settings, **_):
        asked.append(settings.accuracy.objective)
        raise Interrupted("enough", None, None, None)

    monkeypatch.setattr("studies.truss.search.from_starts.audit", noted)
    with pytest.raises(KeyboardInterrupt):
        best_law(
            TrussFront(study_from(stated()), silent()).traded.minimising("peak-force"), silent()
        )
    assert asked == [1e-4]


def test_a_motion_without_a_jerk_asks_for_the_range():
    """The least acceleration steps where no jerk is capped."""
    study = study_from(stated(["peak-acceleration", "peak-jerk"], caps={}) | {"duration": 10.0})
    words = r"no finite peak angular jerk: give --range, e.g. 0\.0502\d*\.\.0\.20\d+$"
    with pytest.raises(StudyError, match=words):
        list(TrussFront(study, silent()).ends())
