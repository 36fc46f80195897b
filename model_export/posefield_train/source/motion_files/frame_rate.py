"""Frame rates: whole and broadcast rates that rounded times stand for."""

BROADCAST_RATES = tuple(1000.0 * base / 1001.0 for base in (24, 30, 60, 120))
RATE_TOLERANCE = 1e-4
"""Relative error of a frame time cut to few digits, such as .008333 or 0.0333333."""


def snapped_rate(frame_time: float) -> float:
    """Return frames per second: the nearest whole or broadcast rate within the tolerance.

    Otherwise the inverse of the frame time.
    """
    rate = 1.0 / frame_time
    nearest = min((max(1.0, float(round(rate))), *BROADCAST_RATES), key=lambda c: abs(c - rate))
    return nearest if abs(nearest - rate) <= RATE_TOLERANCE * nearest else rate
