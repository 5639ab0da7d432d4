"""A whole data set, part by part: each part's results are a file of their own until all are there.

A run that was stopped leaves `RESULTS.parquet.parts`, in which each file is whole; the next run with the same data set
and options does only what is missing. At the end the parts become one file.
"""

import concurrent.futures
import contextlib
import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import write_text
from jaxmotor.fleet._dataset import DIAGNOSED_PER_PART, Dataset, Part, open_dataset
from jaxmotor.fleet._extra import needs
from jaxmotor.fleet._identify_part import Options, identify_part
from jaxmotor.fleet._table import doubled_names, join, read_about, write_rows

FORMAT = 1
"""Of a run's folder."""
PLAN = "plan.json"


class Done(NamedTuple):
    """One part's results are written."""

    part: int
    """Its number."""
    motors: int
    problems: int
    """Motors that could not be identified."""
    parts: int
    """Of the whole data set."""
    before: bool
    """By an earlier run."""


class Summary(NamedTuple):
    """Of a data set."""

    output: Path
    motors: int
    problems: int
    doubled: int
    """Names that more than one motor has."""
    skipped: tuple[str, ...] = ()
    """What is named like a recording and is none."""


Progress = Callable[[Done], None]


class Task(NamedTuple):
    """One part and where its results go; what a worker is sent."""

    number: int
    part: Part
    options: Options
    file: str
    about: dict[str, Any]


def identify_fleet(
    dataset: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    options: Options | None = None,
    cluster: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Summary:
    """Identify every motor of `dataset`, diagnose it where `options` ask for that, and write one row for each to
    `output`, a Parquet file.

    `cluster` is the address of a Dask scheduler, or "local" for a cluster on this machine; its workers read the parts
    and write their results themselves, so that both paths must mean the same to them. Without it, `workers` threads
    (one for each core unless told) do the parts. `progress` hears of each part.

    **Raises:** `JaxmotorError` where the data set cannot be read, something else is in the way of the results, or the
    cluster does not answer. What is wrong with one motor is a sentence in its row.
    """
    needs("pyarrow")
    options, target = options or Options(), Path(output)
    data = open_dataset(dataset, DIAGNOSED_PER_PART if options.diagnose else None)
    about = _about(data, options)
    if _in_the_way(target, about):
        return _summary(target, data.skipped)
    folder = _parts_folder(target, about)
    tasks = [
        Task(number, part, options, str(folder / f"part-{number:06d}.parquet"), about)
        for number, part in enumerate(data.parts)
    ]
    missing = []
    for task in tasks:
        if read_about(Path(task.file)) is None:
            missing.append(task)
        elif progress is not None:
            motors, problems = _counts(Path(task.file))
            progress(Done(task.number, motors, problems, len(tasks), True))
    for number, motors, problems in _results(missing, cluster, workers):
        if progress is not None:
            progress(Done(number, motors, problems, len(tasks), False))
    join([Path(task.file) for task in tasks], target, about)
    shutil.rmtree(folder, ignore_errors=True)
    return _summary(target, data.skipped)


def do_task(task: Task) -> tuple[int, int, int]:
    """Identify one part and write its results; number of the part, of motors, and of those with problems."""
    rows = identify_part(task.part, task.options)
    write_rows(rows, Path(task.file), task.about)
    return task.number, len(rows), sum(row["problem"] is not None for row in rows)


def _results(tasks: list[Task], cluster: str | None, workers: int | None) -> Iterator[tuple[int, int, int]]:
    if cluster is not None:
        from jaxmotor.fleet._cluster import on_cluster

        yield from on_cluster(tasks, do_task, cluster, workers)
        return
    number = min(workers or len(os.sched_getaffinity(0)), max(len(tasks), 1))
    if number == 1:
        yield from map(do_task, tasks)
        return
    # Compiled programs run outside Python's lock, and while they do each thread prepares its next batch: threads are
    # enough for as many cores as Python's part of the time leaves room for, five or so.
    pool = concurrent.futures.ThreadPoolExecutor(number)
    try:
        for future in concurrent.futures.as_completed([pool.submit(do_task, task) for task in tasks]):
            yield future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _about(data: Dataset, options: Options) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "data_set": data.identity,
        "files": data.files,
        "parts": len(data.parts),
        "options": options._asdict(),
    }


def _in_the_way(target: Path, about: dict[str, Any]) -> bool:
    """True where the results are there already. **Raises:** `JaxmotorError` where something else is."""
    if target.is_dir():
        raise JaxmotorError(f"{target}: is a folder; give the name of a file for the results")
    if not target.exists():
        return False
    if read_about(target) == about:
        return True
    raise JaxmotorError(
        f"{target}: is there already and is not the results of this data set with these options; "
        "choose another name or delete it"
    )


def _parts_folder(target: Path, about: dict[str, Any]) -> Path:
    folder = target.with_name(f"{target.name}.parts")
    plan = folder / PLAN
    try:
        folder.mkdir(exist_ok=True)
        if plan.exists():
            with contextlib.suppress(ValueError):
                if json.loads(plan.read_text(encoding="utf-8")) == about:
                    return folder
        if any(folder.iterdir()):
            raise JaxmotorError(
                f"{folder}: holds unfinished results of another data set, of one that has changed since, or of other "
                "options; delete it or choose another name"
            )
    except OSError as error:
        raise JaxmotorError(f"{folder}: cannot be made ({error.strerror}); choose another folder") from error
    write_text(plan, json.dumps(about))
    return folder


def _counts(file: Path) -> tuple[int, int]:
    problems = needs("pyarrow.parquet").read_table(file, columns=["problem"]).column("problem")
    return len(problems), len(problems) - problems.null_count


def _summary(target: Path, skipped: tuple[str, ...]) -> Summary:
    motors, problems = _counts(target)
    return Summary(target, motors, problems, len(doubled_names([target])), skipped)
