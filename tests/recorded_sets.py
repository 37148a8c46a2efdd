"""Small LeRobot data sets and bags, written by the libraries that others write them with."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from filmed import RATE, pictures, place, write_video
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

CAMERA = "observation.images.top"
NAMES = ["joint_1", "ee.x", "ee.y", "ee.z"]
LENGTHS = (10, 14)
ROS = get_typestore(Stores.ROS2_HUMBLE)
#: What the clock of a bag says at its first picture [s].
NOW = 1.7e9


def episode(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Times ``(T,)`` [s] and states ``(T, 4)`` of an episode."""
    time = np.arange(LENGTHS[number]) / RATE + 0.3  # when the gripper moves
    state = np.stack([0 * time, place(time), 0 * time + number, 0 * time + 0.3], axis=1)
    return time, state


def _table(number: int, first: int, **more: Any) -> pa.Table:
    time, state = episode(number)
    columns = {
        "observation.state": pa.array(state.tolist(), pa.list_(pa.float32(), 4)),
        "action": pa.array(state[:, :2].tolist(), pa.list_(pa.float32(), 2)),
        "timestamp": pa.array(time - time[0], pa.float32()),
        "episode_index": pa.array([number] * len(time), pa.int64()),
        "index": pa.array(range(first, first + len(time)), pa.int64()),
    }
    return pa.table(columns | more)


def write_lerobot(path: Path, version: str, **features: Any) -> Path:
    """A set of two episodes in version v2.1 or v3.0; ``features`` are put in the place of others."""
    told = {
        CAMERA: {"dtype": "video", "shape": [48, 64, 3], "names": ["height", "width", "channels"]},
        "observation.state": {"dtype": "float32", "shape": [4], "names": NAMES},
        "action": {"dtype": "float32", "shape": [2], "names": {"motors": ["a", "b"]}},
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        "episode_index": {"dtype": "int64", "shape": [1], "names": None},
        **features,
    }
    info: dict[str, Any] = {"codebase_version": version, "fps": RATE, "total_episodes": 2, "features": told}
    (path / "meta").mkdir(parents=True)
    seen = [pictures(episode(k)[0]) for k in (0, 1)]
    if version == "v2.1":
        info |= {
            "chunks_size": 1000,
            "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
            "video_path": "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
        }
        for k in (0, 1):
            _put(path / f"data/chunk-000/episode_{k:06d}.parquet", _table(k, 0))
            _film(path / f"videos/chunk-000/{CAMERA}/episode_{k:06d}.mp4", seen[k])
    else:
        info |= {
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        }
        _put(path / "data/chunk-000/file-000.parquet", pa.concat_tables([_table(0, 0), _table(1, LENGTHS[0])]))
        _film(path / f"videos/{CAMERA}/chunk-000/file-000.mp4", seen[0] + seen[1])
        begin = np.array([0, LENGTHS[0]]) / RATE
        rows = {
            "episode_index": [0, 1],
            "length": list(LENGTHS),
            "data/chunk_index": [0, 0],
            "data/file_index": [0, 0],
            f"videos/{CAMERA}/chunk_index": [0, 0],
            f"videos/{CAMERA}/file_index": [0, 0],
            f"videos/{CAMERA}/from_timestamp": begin.tolist(),
            f"videos/{CAMERA}/to_timestamp": (begin + np.array(LENGTHS) / RATE).tolist(),
        }
        _put(path / "meta/episodes/chunk-000/file-000.parquet", pa.table(rows))
    (path / "meta/info.json").write_text(json.dumps(info))
    return path


def write_lerobot_images(path: Path) -> Path:
    """The same with the pictures in the table, as sets without video have them."""
    write_lerobot(path, "v2.1", **{CAMERA: {"dtype": "image", "shape": [48, 64, 3], "names": None}})
    for k in (0, 1):
        cells = [{"bytes": png(p), "path": ""} for p in pictures(episode(k)[0])]
        _put(path / f"data/chunk-000/episode_{k:06d}.parquet", _table(k, 0, **{CAMERA: pa.array(cells)}))
    return path


def _put(path: Path, table: pa.Table) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def _film(path: Path, frames: list[np.ndarray]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_video(path, frames, np.arange(len(frames)) / RATE)


def png(picture: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".png", picture[..., ::-1])[1])


def stamp(seconds: float, frame: str = "base") -> Any:
    whole, rest = divmod(round(seconds * 1e9), 10**9)
    time = ROS.types["builtin_interfaces/msg/Time"](whole, rest)
    return ROS.types["std_msgs/msg/Header"](time, frame)


def image(picture: np.ndarray, seconds: float, encoding: str = "rgb8") -> Any:
    height, width = picture.shape[:2]
    rows = picture.reshape(height, -1)
    padded = np.concatenate([rows, np.zeros((height, 5), np.uint8)], axis=1)  # a row may be longer than its pixels
    header = stamp(seconds, "lens")
    return ROS.types["sensor_msgs/msg/Image"](header, height, width, encoding, 0, padded.shape[1], padded.reshape(-1))


def compressed(picture: np.ndarray, seconds: float) -> Any:
    data = np.frombuffer(png(picture), np.uint8)
    return ROS.types["sensor_msgs/msg/CompressedImage"](stamp(seconds, "lens"), "png", data)


def deep(metres: np.ndarray, seconds: float, encoding: str) -> Any:
    """Depth ``(H, W)`` [m] as depth cameras send it; encoding ``"png"``: compressed."""
    height, width = metres.shape
    if encoding == "png":
        header = np.zeros(12, np.uint8)  # of compressed_depth_image_transport
        data = np.frombuffer(bytes(cv2.imencode(".png", np.round(1000 * metres).astype(np.uint16))[1]), np.uint8)
        full = np.concatenate([header, data])
        return ROS.types["sensor_msgs/msg/CompressedImage"](stamp(seconds), "16UC1; compressedDepth png", full)
    raw = np.round(1000 * metres).astype("<u2") if encoding == "16UC1" else metres.astype("<f4")
    rows = np.pad(raw.view(np.uint8).reshape(height, -1), [(0, 0), (0, 4)])
    header = stamp(seconds, "lens")
    return ROS.types["sensor_msgs/msg/Image"](header, height, width, encoding, 0, rows.shape[1], rows.reshape(-1))


def pose(seconds: float, x: float) -> Any:
    place, turn = (ROS.types[f"geometry_msgs/msg/{name}"] for name in ("Point", "Quaternion"))
    made = ROS.types["geometry_msgs/msg/Pose"](place(x, 0.1, 0.3), turn(0.0, 0.0, 0.6, 0.8))  # x y z w
    return ROS.types["geometry_msgs/msg/PoseStamped"](stamp(seconds), made)


def transforms(seconds: float, x: float) -> Any:
    vector, turn = (ROS.types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Quaternion"))
    made = ROS.types["geometry_msgs/msg/Transform"](vector(x, 0.1, 0.3), turn(0.0, 0.0, 0.6, 0.8))
    stamped = ROS.types["geometry_msgs/msg/TransformStamped"]
    both = [stamped(stamp(seconds), child, made) for child in ("gripper", "elbow")]
    return ROS.types["tf2_msgs/msg/TFMessage"](both)


def write_bag(path: Path, topics: dict[str, Callable[[], list[tuple[float, Any]]]], storage: str = "mcap") -> Path:
    """A bag of topics, each with messages and the time of writing them [s]; a lone file if ``path`` is one."""
    folder = path.with_suffix("") if path.suffix else path
    with Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        for topic, made in topics.items():
            messages = made()
            kind = messages[0][1].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=ROS)
            for time, message in messages:
                writer.write(connection, round(time * 1e9), ROS.serialize_cdr(message, kind))
    if path.suffix:
        next(folder.glob(f"*.{storage}")).rename(path)
        (folder / "metadata.yaml").unlink()
        folder.rmdir()
    return path
