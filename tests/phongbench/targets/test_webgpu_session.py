"""A device that crashes, hangs, lies or is lost: a sentence, and nothing else is harmed."""

import sys
import textwrap

import pytest

from phongbench.errors import InputError, MeasurementError
from phongbench.targets.webgpu import session as sessions
from phongbench.targets.webgpu.session import Adapter, Session

ADAPTER = {"name": "Made-up", "driver": "1", "backend": "Vulkan", "software": False, "features": [], "version": "0"}
TALKS = "import sys, os\nfrom phongbench.targets.webgpu.messages import receive, send\n"


def worker(body: str) -> tuple[str, ...]:
    """A worker's process that does something else."""
    return (sys.executable, "-c", TALKS + textwrap.dedent(body))


def ask(body: str, patience: float = 60.0, question: str = "adapter") -> object:
    with Session(worker(body), (patience, patience)) as session:
        return session.adapter() if question == "adapter" else session.ask(question)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("sys.exit('panicked at wgpu-core: Parent device is lost')", "Parent device is lost"),
        ("os.abort()", "the device's process ended"),
        ("receive(sys.stdin.buffer); sys.exit(3)", "the device's process ended: exit 3"),
        ("receive(sys.stdin.buffer); sys.stdout.write('half'); sys.exit(0)", "the device's process ended"),
        ("receive(sys.stdin.buffer); send(sys.stdout.buffer, (False, 'no memory is left'))", "no memory is left"),
    ],
)
def test_what_goes_wrong_is_a_sentence_with_a_way_out(body: str, words: str) -> None:
    with pytest.raises(MeasurementError, match=words) as caught:
        ask(body)
    assert caught.value.fix


def test_a_device_that_hangs_is_given_up() -> None:
    with pytest.raises(MeasurementError, match="did not answer in time"):
        ask("receive(sys.stdin.buffer); sys.stdin.buffer.read()", patience=0.5)


def test_a_process_that_does_not_start_is_a_sentence_too() -> None:
    with pytest.raises(MeasurementError, match="does not start"), Session(("/no/such/program",)):
        pass


def test_it_is_gone_after_the_block_whatever_it_does() -> None:
    with Session(
        worker("receive(sys.stdin.buffer); send(sys.stdout.buffer, (True, None)); sys.stdin.buffer.read()")
    ) as one:
        assert one.adapter() is None
    assert one._process.poll() is not None


def test_an_adapter_of_software_is_called_so() -> None:
    told = f"receive(sys.stdin.buffer); send(sys.stdout.buffer, (True, {ADAPTER}))"
    assert ask(told) == Adapter("Made-up", "1", "Vulkan", False, (), "0")
    assert Adapter("Made-up", "1", "Vulkan", False, (), "0").title == "Made-up"
    assert "no GPU" in Adapter("lavapipe", "1", "Vulkan", True, (), "0").title


def test_without_the_binding_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"phongbench\[gpu\]"):
        Session()
    sessions.found.cache_clear()
    assert "phongbench[gpu]" in str(sessions.found()[1])
    sessions.found.cache_clear()
