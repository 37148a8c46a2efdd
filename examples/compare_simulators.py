"""Two simulators, the same draws from the prior: how far apart are they, and which parameters drive it?"""

from muslin.core.comparison import compare_simulators

if __name__ == "__main__":
    found = compare_simulators("fling", ["mujoco", "pybullet"], draws=20)
    print(found.text())
