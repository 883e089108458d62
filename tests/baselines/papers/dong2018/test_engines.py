"""The paper's follower on both engines: small versions of what `docs/engines.md` states for 100 episodes."""

import math

import pytest

from baselines.papers.dong2018.engines import following, motion
from follow_env import IDS


@pytest.mark.parametrize("scene", IDS)
def test_the_kinematic_robot_goes_where_pybullets_goes(scene):
    """Within 2 cm and 0.5 deg over windows of 2 s; without restart a few centimeters after 14 s."""
    result = motion(scene, range(2))
    assert 1e-5 < result.position < 0.02
    assert 0.0 < result.yaw < math.radians(0.5)
    (time, position, yaw) = result.growth[-1]
    assert time == 14.0
    assert position < 0.05
    assert yaw < math.radians(1.0)


@pytest.mark.parametrize("scene", IDS)
def test_the_follower_does_as_well_on_both_engines(scene):
    for compared in following(scene, range(3)):
        low, high = (0.01, 0.2) if "(rad)" in compared.quantity else (4.0, 40.0)
        assert low < compared.physics < high, compared
        assert compared.ratio.value == pytest.approx(1.0, abs=0.05), compared
        assert compared.same_end == 1.0
