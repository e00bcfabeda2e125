"""The Gymnasium environment."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import photocoag as pc
from photocoag.envs import TreatmentEnv


def test_passes_the_checker():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(normalized|symmetric|maximum value is infinity|minimum value is -infinity).*")
        check_env(TreatmentEnv(pc.Config().set("plant.model", "reduced")), skip_render_check=True)


def test_steps_are_those_of_the_simulation(config, run):
    env = TreatmentEnv(config)
    env.reset()
    env._eye.reset(config.run.seed, config.plant.absorption_factor)
    for row in run.cycles:
        observation, reward, terminated, truncated, info = env.step(np.array([row["power_W"]]))
        assert observation[0] == row["volume_measured_K"] and observation[1] == row["power_W"]
        assert info["peak_true_K"] == row["peak_true_K"]
        assert reward == -(((row["peak_true_K"] - 30.0) / 30.0) ** 2)
        assert not terminated
    assert truncated
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.array([0.0]))


def test_seeds_repeat_eye_and_noise():
    env = TreatmentEnv(absorption_factor=(0.35, 1.5))
    seen = []
    for seed in (4, 4, 5):
        _, info = env.reset(seed=seed)
        seen.append((info["absorption_factor"], *(env.step(np.array([0.02]))[0][0] for _ in range(5))))
    assert seen[0] == seen[1] != seen[2]
    one_eye = TreatmentEnv()
    noises = [(one_eye.reset(seed=seed), one_eye.step(np.array([0.02]))[0][0])[1] for seed in (4, 4, 5)]
    assert noises[0] == noises[1] != noises[2]


def test_cost_is_apart_from_the_reward():
    env = TreatmentEnv(absorption_factor=(1.5, 1.5))
    env.reset(seed=1)
    costs = [env.step(env.action_space.high)[4] for _ in range(200)]
    assert costs[0]["cost"] == 0.0
    assert costs[-1]["cost"] == costs[-1]["peak_true_K"] - 32.0 > 0.0


def test_vectorised():
    many = gymnasium.make_vec("photocoag/Treatment-v0", num_envs=3, absorption_factor=(0.5, 1.5))
    observations, _ = many.reset(seed=1)
    assert observations.shape == (3, 3)
    observations, rewards, *_ = many.step(np.full((3, 1), 0.02))
    assert rewards.shape == (3,) and len(set(observations[:, 0])) == 3


@pytest.mark.parametrize("action", [[np.nan], [0.1, 0.2], [np.inf], []])
def test_bad_actions_are_named(action):
    env = TreatmentEnv(pc.Config().set("plant.model", "reduced"))
    env.reset(seed=1)
    with pytest.raises(pc.ConfigError) as caught:
        env.step(np.array(action))
    assert caught.value.key == "action"
