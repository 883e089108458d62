"""Settings that are drawn: by the episode's seed, each in its place, and none where none is asked for."""

import json
import math

import numpy as np
import pytest

from follow_env.config import EnvConfig
from follow_env.domain import Choice, Domain, LogUniform, Uniform
from follow_env.envs.batch import FollowVectorEnv
from follow_env.envs.follow import FollowEnv

SPREAD = {
    "engine": "kinematic",
    "route": {"name": "paper", "turns": {"choice": [0, 1, 2, 3]}, "largest_turn_deg": {"uniform": [30, 50]}},
    "walking_speed": {"uniform": [0.4, 1.6]},
    "latency_s": {"choice": [0.0, 0.1, 0.2]},
    "sensor": {"measurement": {"bearing_noise": {"log_uniform": [0.005, 0.05]}}},
    "robot": {"max_speed": {"uniform": [0.6, 1.2]}},
    "outfit": {"choice": ["blue", "red"]},
    "person": {"choice": ["man", "woman"]},
    "light": {"choice": ["normal", "dim"]},
}


def test_plain_data_and_objects_are_the_same_domain():
    plain = Domain({"walking_speed": {"uniform": [0.4, 1.6]}, "outfit": {"choice": ["blue", "red"]}})
    objects = Domain({"walking_speed": Uniform(0.4, 1.6), "outfit": Choice("blue", "red")})
    assert plain.nominal == objects.nominal == EnvConfig(walking_speed=1.0)
    one, other = (domain.sample(np.random.default_rng(4)) for domain in (plain, objects))
    assert one == other
    assert Domain(json.loads(json.dumps(objects.to_json()))).sample(np.random.default_rng(4)) == one


def test_the_distributions_are_what_they_say():
    rng = np.random.default_rng(0)
    uniform = np.array([Uniform(2.0, 4.0).sample(rng) for _ in range(4000)])
    log = np.log([LogUniform(0.01, 1.0).sample(rng) for _ in range(4000)])
    for drawn, low, high in ((uniform, 2.0, 4.0), (log, math.log(0.01), 0.0)):
        assert low <= drawn.min() < drawn.max() <= high
        assert drawn.mean() == pytest.approx(0.5 * (low + high), abs=4.0 * (high - low) / math.sqrt(12.0 * 4000))
    counts = [[Choice("a", "b", "c").sample(rng) for _ in range(3000)].count(name) for name in "abc"]
    assert min(counts) > 850
    assert LogUniform(0.01, 1.0).nominal == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"walking_speed": {"uniform": [1.0]}}, ("[1.0]", "two")),
        ({"walking_speed": {"uniform": [1.2, 0.4]}}, ("1.2", "low <= high")),
        ({"walking_speed": {"log_uniform": [0.0, 1.0]}}, ("0.0", "0 < low")),
        ({"walking_speed": {"uniform": [0.5, math.nan]}}, ("nan", "finite")),
        ({"outfit": {"choice": []}}, ("nothing", "at least one")),
        ({"outfit": {"choice": ["bleu", "red"]}}, ("'bleu'", "did you mean 'blue'")),
        ({"walkin_speed": {"uniform": [0.5, 1.0]}}, ("'walkin_speed'", "did you mean 'walking_speed'")),
    ],
)
def test_a_wrong_distribution_is_one_clear_error(settings, words):
    with pytest.raises(ValueError, match=r"expected|did you mean") as raised:
        FollowEnv(**settings)
    for word in words:
        assert word in str(raised.value)


def test_an_episode_draws_its_settings_from_its_seed():
    env, again = FollowEnv(SPREAD), FollowEnv(Domain(SPREAD))
    drawn = []
    for seed in range(30):
        observation, _ = env.reset(seed=seed)
        other, _ = again.reset(seed=seed)
        assert env.config == again.config
        assert (observation == other).all()
        drawn.append(env.config)
    for name in ("walking_speed", "latency_s", "outfit", "person", "light", "robot", "sensor"):
        assert len({getattr(config, name) for config in drawn}) > 1, name
    assert {config.route["turns"] for config in drawn} == {0, 1, 2, 3}
    env.reset(seed=3)
    assert env.config == drawn[3]
    assert len(env.motion.turns) == drawn[3].route["turns"]
    env.close()


def test_what_is_fixed_draws_nothing():
    """The same numbers from the generator, hence the same episode, as before there were domains."""
    fixed, plain = FollowEnv(Domain({"walking_speed": 1.1})), FollowEnv(walking_speed=1.1)
    assert fixed.domain.is_fixed
    for env in (fixed, plain):
        env.reset(seed=5)
    assert fixed.np_random.bit_generator.state == plain.np_random.bit_generator.state


def test_a_batch_draws_from_the_same_domain():
    env = FollowVectorEnv(40, SPREAD)
    env.reset(seed=0)
    speeds = {config.walking_speed for config in env.configs}
    assert len(speeds) == 40
    assert min(speeds) >= 0.4
    assert max(speeds) <= 1.6
    env.close()


def test_what_an_environment_keeps_cannot_be_drawn():
    env = FollowEnv(control_hz={"choice": [30, 60]})

    def play():
        for seed in range(20):
            env.reset(seed=seed)

    with pytest.raises(ValueError, match=r"control_hz is 60 in one episode and 30 in another; an environment keeps it"):
        play()


def test_one_scene_after_another():
    env = FollowEnv(scene=Choice("corridor", "indoor"), engine="kinematic")
    seen = set()
    for seed in range(10):
        env.reset(seed=seed)
        seen.add(env.scene.name)
        env.step(np.zeros(2))
    assert seen == {"corridor", "indoor"}


def test_settings_over_a_domain_or_a_record_replace_theirs():
    base = EnvConfig(walking_speed=1.3, robot={"max_speed": 0.8})
    assert Domain.of(base, latency_s=0.1).nominal == EnvConfig.of(base, latency_s=0.1)
    assert Domain.of(base, robot={"track_width": 0.2}).nominal.robot.max_speed == 0.8
    wider = Domain.of(Domain.of(base, light={"choice": ["normal", "dim"]}), walking_speed=Uniform(0.5, 0.7))
    config = wider.sample(np.random.default_rng(0))
    assert 0.5 <= config.walking_speed <= 0.7
    assert config.robot.max_speed == 0.8
