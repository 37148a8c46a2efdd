"""The picture of docs/annotation.md: ``python examples/annotation_picture.py``; needs mujoco and Chromium."""

import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

import numpy as np

from muslin.cli.annotating.choosing import joined, spread
from muslin.cli.annotating.server import AnnotationServer
from muslin.cli.annotating.session import Session
from muslin.core.annotated_frames import places
from muslin.core.annotations import SEEN, UNDECIDED, Annotations
from muslin.core.camera import Camera
from muslin.core.frames import Frames, Video
from muslin.core.registry import REGISTRY
from muslin.core.renderer import find_renderer
from muslin.core.rollout import rollout
from muslin.core.scenario import STANDARD_GRAVITY
from muslin.core.scenarios import preset
from muslin.core.video_frames import VideoFrames
from muslin.core.video_store import save_videos

TARGET = Path(__file__).resolve().parent.parent / "docs/annotation.png"
NAMES = ("corner_a", "corner_b", "corner_c", "corner_d")
ANNOTATED = 15


def annotated(folder: Path) -> tuple[Annotations, VideoFrames]:
    """A simulated fling as a video, with the corners of the cloth marked in the first frames and half of the next."""
    base = preset("fling")
    scenario, material = base.scenario(), base.default_material()
    vertices = rollout(REGISTRY.get("simulator", "mujoco")(), scenario, material).vertices
    camera = Camera.framing(vertices, width=640, height=480)
    with find_renderer("auto").open(scenario.scene(material, np.array([0.0, 0.0, -STANDARD_GRAVITY]))) as view:
        rgb = np.stack([view.render(v, camera).rgb for v in vertices])
    save_videos([Video("fling", scenario.times, Frames(rgb, camera=camera))], folder / "cloth.zarr")
    video = VideoFrames(folder / "cloth.zarr")
    made, _ = joined(video, NAMES, spread(video, None, 40), None, None)
    rest = scenario.body.vertices
    far = rest - rest.mean(axis=0)
    across = np.argsort(far.std(axis=0))[1:]
    corners = [int(np.argmax(far[:, across] @ np.array(way))) for way in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
    for n in range(ANNOTATED + 1):
        points = camera.project(vertices[places(made, video)[n][1]][corners])[0]
        flags = np.full(len(NAMES), SEEN, np.int8)
        flags[2 if n == ANNOTATED else 4 :] = UNDECIDED
        made = made.with_frame(n, points, flags)
    return made, video


def main() -> None:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("there is no Chromium to draw the page with")
    with tempfile.TemporaryDirectory() as name:
        made, video = annotated(Path(name))
        session = Session(made, places(made, video), video, Path(name) / "keypoints.json")
        server = AnnotationServer(session, "")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]
        options += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
        options += [f"--user-data-dir={name}/browser", "--window-size=1280,800", "--virtual-time-budget=4000"]
        subprocess.run([chromium, *options, f"--screenshot={TARGET}", server.url], check=True, capture_output=True)
        server.shutdown()
        server.server_close()
    print(f"wrote {TARGET}")


if __name__ == "__main__":
    main()
