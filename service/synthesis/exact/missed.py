"""Messages for constraints that a motion does not meet."""

from collections.abc import Iterator, Sequence

from service.motion.answer import Met
from service.motion.errors import OutOfReach
from service.synthesis.exact.goals import Goals


def sentences(met: Sequence[Met]) -> tuple[str, ...]:
    """Return a sentence for each constraint that is not met."""
    return tuple(_sentence(each) for each in met if not each.reached)


def refuse(goals: Goals, met: Sequence[Met]) -> None:
    """Raise OutOfReach, which names the first, if a constraint is not met."""
    for field, each in zip(_fields(goals, met), met, strict=True):
        if not each.reached:
            raise OutOfReach(field, "; ".join(sentences(met)))


def _fields(goals: Goals, met: Sequence[Met]) -> Iterator[str]:
    """Yield the field of each constraint in the question; controls precede targets."""
    first = len(met) - len(goals.targets)
    for index, each in enumerate(met):
        yield f"controls/{each.what}" if index < first else f"targets/{index - first}"


def _sentence(met: Met) -> str:
    miss = f"{100.0 * met.miss:.1f} cm" if met.unit == "m" else f"{met.miss:.3g} {met.unit}"
    return f"{met.what} stays {miss} from its target: out of reach"
