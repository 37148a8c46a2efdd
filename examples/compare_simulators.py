"""Two simulators, the same draws from the prior: how far apart are they, and which parameters drive it?"""

from muslin.core.comparison import compare_simulators


def progress(what: str, done: int, total: int) -> None:
    print(f"\r{what}: {done} of {total}", end="\n" if done == total else "", flush=True)


if __name__ == "__main__":
    found = compare_simulators("fling", ["mujoco", "pybullet"], draws=20, progress=progress)
    print(found.text())
