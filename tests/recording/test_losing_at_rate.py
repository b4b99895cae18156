"""Full buses, recorded through the whole service: every frame is in the file, in its order, or counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.soak.rates import run

SECONDS = 8


@pytest.mark.timeout(600)
@pytest.mark.parametrize(("buses", "rate_hz", "most_lost"), [(1, 8000, 0.0), (3, 2000, 0.001)])
def test_nothing_is_lost_at_full_rate(tmp_path: Path, buses: int, rate_hz: int, most_lost: float) -> None:
    """A busy machine sends slower, or all at once later: that is told, and changes nothing of what must be kept."""
    rates = run(tmp_path, buses, rate_hz, SECONDS)
    print(rates.summary)
    assert rates.faults == ()
    assert sum(rates.sent) == buses * rate_hz * SECONDS
    assert rates.share_lost <= most_lost
