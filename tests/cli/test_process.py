"""What a command owes the shell around it: streams of any kind, closed or full, and signals at any time."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import gammastar
from gammastar.cli import main, process
from gammastar.mission import load

pytestmark = pytest.mark.skipif(os.name == "nt", reason="shells and signals of Unix")

ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(gammastar.__file__).parents[1])}
COMMAND = [sys.executable, "-m", "gammastar"]
FLY = "fly upright --set flight.duration=0.2"


def shell(line: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a line of shell in which `gammastar` is the command."""
    line = f'gammastar() {{ {sys.executable} -m gammastar "$@"; }}; {line}'
    return subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, env=ENVIRONMENT | environment, timeout=120, check=False
    )


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full", "2>/dev/null"])
def test_a_flight_does_not_fail_because_nobody_hears_its_notes(redirection: str) -> None:
    answer = shell(f"gammastar {FLY} {redirection}")
    assert answer.returncode == 0
    assert "flew to the end" in answer.stdout.splitlines()[-1]


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
def test_a_refusal_stays_a_refusal_when_nobody_hears_why(redirection: str) -> None:
    answer = shell(f"gammastar fly nothing {redirection}")
    assert answer.returncode == 2
    assert answer.stdout == ""


@pytest.mark.parametrize("redirection", [">&-", ">/dev/full"])
@pytest.mark.parametrize("command", [FLY, "missions --json", "--version", "--help", "fly --help", ""])
def test_results_that_cannot_be_written_are_an_error(command: str, redirection: str) -> None:
    answer = shell(f"gammastar {command} {redirection}")
    assert answer.returncode == 1
    (line,) = answer.stderr.splitlines()
    assert line.startswith("error: standard output must be open")


@pytest.mark.parametrize("command", [FLY, "missions", "--version", "--help", "fly --help", ""])
def test_a_reader_that_goes_away_ends_a_command_quietly(command: str) -> None:
    answer = shell(f"(gammastar {command}; echo $? >&2) | true")
    assert answer.stderr == "141\n"


@pytest.mark.parametrize(
    "environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]
)
def test_letters_that_a_terminal_lacks_are_escaped(environment: dict[str, str], tmp_path: Path) -> None:
    file = tmp_path / "mission.toml"
    file.write_text(load("upright").with_values({"title": "é"}).toml(), encoding="utf-8")
    answer = shell(f"gammastar fly 'é.toml'; gammastar show {file} | head -1", **environment)
    (line,) = answer.stderr.splitlines()
    assert line.startswith("error: \\")
    assert "a mission must be a file" in line
    assert answer.stdout == 'title = "\\xe9"\n'


def test_json_is_ascii_and_says_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "upright", "--json", "--set", "title=é \N{ROCKET}"]) == 0
    printed = capsys.readouterr().out
    assert printed.isascii()
    assert json.loads(printed)["title"] == "é \N{ROCKET}"


def started(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT
    )


def stopped(running: subprocess.Popen[str], number: int) -> str:
    """Send a signal and return what came on stderr; nothing may come on stdout."""
    running.send_signal(number)
    out, err = running.communicate(timeout=60)
    assert out == ""
    assert running.returncode == 128 + number
    return err


def test_an_interrupt_while_libraries_load_is_one_line() -> None:
    """As soon as the first file of a library has been opened."""
    program = (
        "import os, signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'numpy': os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "sys.argv = ['gammastar', 'missions']\n"
        "from gammastar.cli import main\n"
        "sys.exit(main())\n"
    )
    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=ENVIRONMENT, check=False
    )
    assert answer.returncode == 130
    assert answer.stderr == "interrupted; no file was left half written\n"


def test_a_signal_while_a_text_is_executed_keeps_its_exit_code(tmp_path: Path) -> None:
    """As `dataclass` does while modules load: `python -m` would end by SIGINT then, whatever the signal."""
    (tmp_path / "program.py").write_text(
        "import os, signal, sys\n"
        "from gammastar import cli\n"
        "cli._run = lambda _: exec('os.kill(os.getpid(), signal.SIGTERM)\\nwhile True: pass')\n"
        "sys.exit(cli.main([]))\n"
    )
    answer = subprocess.run([sys.executable, "-m", "program"], cwd=tmp_path, env=ENVIRONMENT, check=False)
    assert answer.returncode == 143


def test_a_slower_machine_is_one_line(tmp_path: Path) -> None:
    """No compiler answers: what flies instead is told, and not where in our code."""
    file = tmp_path / "mission.toml"
    vary = {"campaign.vary": [{"quantity": "start.attitude", "kind": "any"}], "flight.duration": 0.1}
    file.write_text(load("upright").with_values(vary).source(), encoding="utf-8")
    answer = shell(
        f"PATH=/nowhere gammastar campaign {file} --flights 1 --out {tmp_path / 'out'}",
        XDG_CACHE_HOME=str(tmp_path),
        CC="",
    )
    assert answer.returncode == 0
    (line,) = answer.stderr.splitlines()
    assert line.startswith("warning: CasADi's machine flies, some hundred times slower: ")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_a_flight_leaves_nothing(number: int, tmp_path: Path) -> None:
    """A long flight: one line, the code of the signal, no folder."""
    running = started("fly", "upright", "--out", str(tmp_path / "out"), "--set", "flight.duration=1900")
    with contextlib.suppress(subprocess.TimeoutExpired):
        running.wait(2)
    assert stopped(running, number).splitlines() == ["interrupted; no file was left half written"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("verb", [("fly", "upright"), ("reproduce",)])
def test_a_signal_while_drawing_leaves_nothing(verb: tuple[str, ...], number: int, tmp_path: Path) -> None:
    """Also not the folder in which the files were being made."""
    running = started(*verb, "--out", str(tmp_path / "out"))
    ending = time.monotonic() + 60
    while not list(tmp_path.glob(".gammastar-*/*")) and time.monotonic() < ending:
        time.sleep(0.02)
    assert stopped(running, number).splitlines() == ["interrupted; no file was left half written"]
    assert list(tmp_path.iterdir()) == []


def test_a_drawing_that_fails_leaves_the_old_reproduction(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from gammastar.report import reproduce

    drawn: list[Any] = []

    def fail(*_: object) -> None:
        drawn.append(1)
        if len(drawn) == 3:
            raise OSError(28, "No space left on device", "figure")

    monkeypatch.setattr(reproduce, "save", fail)
    (tmp_path / "index.html").write_text("old")
    assert main(["reproduce", "--out", str(tmp_path)]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["index.html"]
    assert (tmp_path / "index.html").read_text() == "old"


def test_signals_are_handled_as_before_afterwards(capsys: pytest.CaptureFixture[str]) -> None:
    before = [signal.getsignal(each) for each in process.STOPS]
    assert main(["missions"]) == 0
    assert [signal.getsignal(each) for each in process.STOPS] == before


def test_a_signal_that_is_ignored_stays_ignored(tmp_path: Path) -> None:
    """As `nohup` asks for."""
    answer = shell(
        f"trap '' HUP; {sys.executable} -m gammastar fly upright --set flight.duration=10 & "
        "sleep 1; kill -HUP $!; wait $!"
    )
    assert answer.returncode == 0


def test_what_a_library_makes_of_an_interrupt_is_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as interrupt:
            raise SystemError("returned a result with an exception set") from interrupt

    monkeypatch.setattr("gammastar.mission.Mission.fly", fail)
    assert main(["fly", "upright"]) == 130
    assert capsys.readouterr().err == "interrupted; no file was left half written\n"


def test_an_error_after_a_signal_is_its_doing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupt while a wrapped function sorts its arguments comes out as a complaint about their types."""

    def fail(*_: object) -> None:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        raise NotImplementedError("Wrong number or type of arguments")

    monkeypatch.setattr("gammastar.mission.Mission.fly", fail)
    assert main(["fly", "upright"]) == 143
    assert capsys.readouterr().err == "interrupted; no file was left half written\n"


def test_a_failure_in_moving_names_the_place_it_was_moved_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(source: Path, target: Path) -> None:
        raise PermissionError(13, "Permission denied", str(source), None, str(target))

    monkeypatch.setattr(os, "replace", fail)
    assert main([*FLY.split(), "--no-figures", "--out", str(tmp_path / "out")]) == 2
    sentence = capsys.readouterr().err
    assert str(tmp_path / "out") in sentence
    assert ".gammastar-" not in sentence


def test_an_interrupt_that_is_lost_in_a_destructor_is_repeated() -> None:
    class Caller:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGTERM)

    def work() -> None:
        caller = Caller()
        del caller
        time.sleep(10)

    began = time.monotonic()
    with process.stopped_by_signals() as received, pytest.raises(KeyboardInterrupt):
        work()
    assert time.monotonic() - began < 5
    assert received == [signal.SIGTERM, signal.SIGALRM]


def test_an_interrupt_that_is_being_answered_is_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine the answer takes longer than the time after which a lost interrupt would come again."""
    from gammastar import cli

    def settle() -> None:
        time.sleep(1.5 * process.AGAIN)

    monkeypatch.setattr(cli, "_run", lambda _: signal.raise_signal(signal.SIGTERM))
    monkeypatch.setattr(process, "settle_streams", settle)
    assert cli.main([]) == 128 + signal.SIGTERM
