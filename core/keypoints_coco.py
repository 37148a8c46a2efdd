"""Annotations as COCO keypoints, the JSON file that annotation programs exchange.

COCO counts pixels from the upper left corner of the picture, muslin from the centre of the upper left pixel: a point at
(0, 0) here is at (0.5, 0.5) in the file.

What COCO does not know stands in keys of muslin's own, which other programs skip: ``info.muslin`` tells the recordings,
and ``undecided`` of an annotation names keypoints that nobody has looked for yet (COCO has the same 0 for those and for
keypoints that are not in the picture).

Reference:
    cocodataset.org, "Data format", keypoint detection.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .annotations import ABSENT, HIDDEN, UNDECIDED, Annotations, blank, check_keypoint_names
from .arrays import FloatArray
from .errors import InputError, MissingFileError
from .store import write_text
from .version import __version__

#: From muslin's pixels to COCO's [px].
_CORNER = 0.5

_Id = int | str
_Number = Annotated[float, Field(allow_inf_nan=False)]


class _Image(BaseModel):
    id: _Id
    file_name: str = Field(min_length=1)
    width: int = Field(0, ge=0)
    height: int = Field(0, ge=0)


class _Category(BaseModel):
    id: _Id
    name: str = ""
    keypoints: list[str] = []
    skeleton: list[tuple[int, int]] = []


class _Annotation(BaseModel):
    image_id: _Id
    category_id: _Id
    keypoints: list[_Number] = []
    undecided: list[str] = []


class _Muslin(BaseModel):
    video: dict[str, str]


class _Info(BaseModel):
    muslin: _Muslin | None = None


class _File(BaseModel):
    model_config = ConfigDict(extra="ignore")
    info: _Info = _Info()
    images: list[_Image]
    categories: list[_Category]
    annotations: list[_Annotation] = []


def read_coco(path: Path, category: str = "") -> Annotations:
    """Annotations of one kind of object, at most one of it an image; boxes, segmentations and the like are skipped.

    A keypoint with v = 0 in an annotation is taken as not in the picture, unless muslin wrote that it is undecided;
    an image without annotation is undecided as a whole.

    Args:
        path: of the JSON file.
        category: name of the object, where the file has keypoints of several.

    Raises:
        MissingFileError, InputError: there is no such file, or it holds something that cannot be read this way.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no file {path}")
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON ({error}); COCO keypoints are") from error
    if isinstance(table, list):
        raise InputError(f"{path} is a bare list, as COCO results are; give a data set, with images and categories")
    try:
        return _annotations(_File.model_validate(table), category)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the file"
        more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
        raise InputError(f"{path} does not hold COCO keypoints: {place}: {first['msg']}{more}") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def write_coco(annotations: Annotations, path: Path) -> None:
    """Write the file whole or not at all, in place of one that is there."""
    write_text(path, json.dumps(coco_table(annotations), ensure_ascii=False, indent=1, allow_nan=False) + "\n")


def coco_table(annotations: Annotations) -> dict[str, Any]:
    """What the file holds: an image a frame, and an annotation a frame of which something is decided."""
    a = annotations
    images = [
        {"id": n + 1, "file_name": name, "width": int(width), "height": int(height)}
        for n, (name, (width, height)) in enumerate(zip(a.frames, a.sizes, strict=True))
    ]
    begun = np.flatnonzero((a.flags != UNDECIDED).any(axis=1))
    return {
        "info": {
            "description": "Keypoints of one object, annotated with muslin",
            "version": __version__,
            "muslin": {"video": dict(a.video)},
        },
        "images": images,
        "annotations": [{"id": k + 1, "image_id": int(n) + 1, **_entry(a, int(n))} for k, n in enumerate(begun)],
        "categories": [
            {
                "id": 1,
                "name": "object",
                "supercategory": "object",
                "keypoints": list(a.names),
                "skeleton": [[i + 1, j + 1] for i, j in a.skeleton],
            }
        ],
    }


def _entry(a: Annotations, n: int) -> dict[str, Any]:
    placed = a.flags[n] >= HIDDEN
    corner = np.round(np.where(placed[:, None], a.points[n], -_CORNER) + _CORNER, 3)
    flags = np.maximum(a.flags[n], ABSENT)
    low, high = (corner[placed].min(axis=0), corner[placed].max(axis=0)) if placed.any() else (np.zeros(2), np.zeros(2))
    width, height = np.round(high - low, 3).tolist()
    entry: dict[str, Any] = {
        "category_id": 1,
        "keypoints": [x for (u, v), flag in zip(corner.tolist(), flags.tolist(), strict=True) for x in (u, v, flag)],
        "num_keypoints": int(placed.sum()),
        "bbox": [*low.tolist(), width, height],
        "area": round(width * height, 3),
        "iscrowd": 0,
    }
    if undecided := [name for name, flag in zip(a.names, a.flags[n], strict=True) if flag == UNDECIDED]:
        entry["undecided"] = undecided
    return entry


def _annotations(file: _File, category: str) -> Annotations:
    kind = _category(file.categories, category)
    names = tuple(kind.keypoints)
    check_keypoint_names(names)
    if not file.images:
        raise InputError("there are no images in it")
    number = {image.id: n for n, image in enumerate(file.images)}
    if len(number) < len(file.images):
        raise InputError("two images have the same id")
    frames = tuple(image.file_name for image in file.images)
    sizes = np.array([(i.width, i.height) for i in file.images], np.int64)
    video: Mapping[str, str] = file.info.muslin.video if file.info.muslin is not None else {}
    bare = blank(names, frames, sizes, video, tuple((i - 1, j - 1) for i, j in kind.skeleton))
    points, flags = bare.points.copy(), bare.flags.copy()
    done: set[_Id] = set()
    for k, entry in enumerate(file.annotations):
        if entry.image_id not in number:
            raise InputError(f"annotations.{k} is of image {entry.image_id!r}, which is not in the file")
        if entry.category_id != kind.id or not entry.keypoints:
            continue
        if entry.image_id in done:
            raise InputError(
                f"image {frames[number[entry.image_id]]!r} has several objects with keypoints; muslin looks for one "
                "object: keep one annotation an image"
            )
        done.add(entry.image_id)
        n = number[entry.image_id]
        points[n], flags[n] = _points(entry, names, f"annotations.{k}, of image {frames[n]!r}")
    return Annotations(names, frames, points, flags, sizes, bare.skeleton, video)


def _category(categories: Sequence[_Category], wanted: str) -> _Category:
    found = [c for c in categories if c.keypoints and wanted in ("", c.name)]
    having = ", ".join(repr(c.name) for c in categories if c.keypoints) or "none"
    if not found:
        called = f" {wanted!r}" if wanted else ""
        raise InputError(f"there is no category{called} with keypoints; those that have some: {having}")
    if len(found) > 1:
        raise InputError(f"several categories have keypoints: {having}; say which one with --category")
    return found[0]


def _points(entry: _Annotation, names: tuple[str, ...], place: str) -> tuple[FloatArray, FloatArray]:
    if len(entry.keypoints) != 3 * len(names):
        raise InputError(
            f"{place}: {len(entry.keypoints)} numbers for {len(names)} keypoints; x, y and v of each are wanted"
        )
    x, y, v = np.array(entry.keypoints, float).reshape(-1, 3).T
    if not np.isin(v, (0, 1, 2)).all():
        raise InputError(f"{place}: v must be 0 (not annotated), 1 (hidden) or 2 (seen), but one is {v.max():g}")
    if unknown := set(entry.undecided) - set(names):
        raise InputError(f"{place}: {unknown.pop()!r} is no keypoint of it")
    undecided = np.isin(np.array(names), entry.undecided)
    return np.stack([x, y], axis=1) - _CORNER, np.where(undecided, UNDECIDED, v)
