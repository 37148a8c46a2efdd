import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.errors import InputError
from muslin.core.motion import Motion, inverse, rotate

unit_quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01)


def quaternion(raw: tuple[float, ...]) -> np.ndarray:
    return np.array(raw) / np.linalg.norm(raw)


def test_positions_are_linear_between_samples_and_held_outside() -> None:
    motion = Motion.from_positions(np.array([1.0, 2.0, 4.0]), np.array([[[0.0, 0, 0]], [[1, 2, 3]], [[1, 2, 9]]]))
    got = motion.at(np.array([0.0, 1.5, 2.0, 3.0, 9.0]))[:, 0, :3]
    assert got.tolist() == [[0, 0, 0], [0.5, 1, 1.5], [1, 2, 3], [1, 2, 6], [1, 2, 9]]


def test_rotation_takes_the_short_way_and_stays_a_rotation() -> None:
    half = np.pi / 8
    end = -np.array([np.cos(half), 0, 0, np.sin(half)])  # the same turn of 45 degrees about z, other sign
    poses = np.array([[[0, 0, 0, 1.0, 0, 0, 0]], [[0, 0, 0, *end]]])
    middle = Motion(np.array([0.0, 1.0]), poses).at(np.array([0.5]))[0, 0, 3:]
    assert np.linalg.norm(middle) == pytest.approx(1.0)
    turned = rotate(middle, np.array([1.0, 0, 0]))
    assert turned.tolist() == pytest.approx([np.cos(half), np.sin(half), 0.0])


@given(unit_quaternions, st.tuples(*[st.floats(-10, 10)] * 3))
def test_rotations_keep_lengths_and_invert(raw: tuple[float, ...], vector: tuple[float, ...]) -> None:
    q, v = quaternion(raw), np.array(vector)
    turned = rotate(q, v)
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(v), abs=1e-9)
    np.testing.assert_allclose(rotate(inverse(q), turned), v, atol=1e-9)


def test_one_pose_stands_still() -> None:
    assert Motion.still(2).at(np.array([0.0, 5.0])).shape == (2, 2, 7)


def test_time_going_backwards_says_where() -> None:
    with pytest.raises(InputError, match=r"time\[2\] = 0.5 s follows time\[1\] = 1 s"):
        Motion.from_positions(np.array([0.0, 1.0, 0.5]), np.zeros((3, 1, 3)))


def test_shapes_that_cannot_be() -> None:
    with pytest.raises(InputError, match=r"poses \(K, G, 7\)"):
        Motion(np.zeros(2), np.zeros((2, 1, 3)))


def test_a_pose_that_is_not_known_says_which() -> None:
    poses = np.tile(Motion.still().poses, (3, 2, 1))
    poses[1, 1, 4] = np.nan
    with pytest.raises(InputError, match=r"the pose of gripper 1 at time\[1\] = 0.5 s is not a finite number"):
        Motion(np.array([0.0, 0.5, 1.0]), poses)
    with pytest.raises(InputError, match=r"gripper 0 at time\[0\] = nan s"):
        Motion(np.array([np.nan]), np.zeros((1, 1, 7)))
