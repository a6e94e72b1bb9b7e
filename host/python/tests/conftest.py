"""Makes arms.py importable, and hides the remarks that every simulated robot causes."""

import sys
import warnings
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import rig_dynamics  # noqa: E402


@pytest.fixture(autouse=True)
def without_remarks():
    """Ignore remarks where a test does not ask for them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rig_dynamics.Remark)
        yield
