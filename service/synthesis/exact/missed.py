"""What is said of the goals that a motion does not meet."""

from collections.abc import Iterator, Sequence

from service.motion.answer import Met
from service.motion.errors import OutOfReach
from service.synthesis.exact.goals import Goals


def sentences(met: Sequence[Met]) -> tuple[str, ...]:
    """A sentence for each goal that is not reached."""
    return tuple(_sentence(each) for each in met if not each.reached)


def refuse(goals: Goals, met: Sequence[Met]) -> None:
    """OutOfReach where some goal is not reached; it names the first."""
    for field, each in zip(_fields(goals, met), met, strict=True):
        if not each.reached:
            raise OutOfReach(field, "; ".join(sentences(met)))


def _fields(goals: Goals, met: Sequence[Met]) -> Iterator[str]:
    """Where each of them was asked for: controls are looked at before targets."""
    first = len(met) - len(goals.targets)
    for index, each in enumerate(met):
        yield f"controls/{each.what}" if index < first else f"targets/{index - first}"


def _sentence(met: Met) -> str:
    miss = f"{100.0 * met.miss:.1f} cm" if met.unit == "m" else f"{met.miss:.3g} {met.unit}"
    return f"{met.what} stays {miss} from its target: out of reach"
