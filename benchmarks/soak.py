# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many tasks in one ensemble: ``python -m benchmarks.soak [--tasks N] [--output FOLDER]``.

Every node is a process of its own and stays the same for all tasks, the recorder too. Between tasks
the resident memory, the threads and the open file descriptors of each are read. ``--output`` gets a
page, a picture and the numbers (needs ``slap_ros[studies]``).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil
from slap_msgs.srv import ResetTask

from benchmarks.printing import show
from ensemble.client import RunClient
from ensemble.interfaces import RESET_TASK
from ensemble.launcher import ProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import Spinner, temporary_node
from slap_ros.api.library_descriptions import describe_library
from slap_ros.cli.bars import counting_bars
from slap_ros.domains import get_domain
from slap_ros.evaluation.run_log import RunLog
from slap_ros.files import pretty_json
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.studies.figures import LINES, picture, require_matplotlib
from slap_ros.studies.results import MarkdownTable
from slap_ros.versions import versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOMAIN = "obstacle2d"
PATIENCE = 120.0  # s, for anything: the machine may be busy
MIB = 2**20
SIZE = (6.4, 6.0)  # inches
PANELS = {"memory_mib": "resident memory [MiB]", "threads": "threads", "descriptors": "descriptors"}

PAGE = """\
# Soak: many tasks in one ensemble

One ensemble solved {solved} of {tasks} tasks of {domain}, one after the other. Every node is a
process that lives from the first task to the last. The ensemble uses the shipped shortcuts, and a
recorder writes everything into one bag. Between tasks, resident memory, threads and open
descriptors of each process are read. The tasks took {minutes:.0f} minutes on a machine shared with
other work.

![Memory, threads and descriptors of each process over the tasks](soak.svg)

{table}

Growth is what a task adds in the second half: the median slope over all pairs of samples.

These are its causes, with CPython 3.11, CycloneDDS 11.0.1 and glibc:

- **Histories.** Publishers keep the messages of an episode for late subscribers, up to 1000 per
  topic. These are full after about 50 tasks for states, and after about a hundred for events.
- **Receive buffers.** CycloneDDS puts the announcements of other processes into buffers of 1 MiB
  each, and touches them page by page. An idle process grew by 1.1 to 1.3 KiB per second without
  allocating a byte, until a buffer was full and another took its place: per time, not per task.
  That was most of the 1.6 to 2.2 KiB per task that this page used to report. embedded_ros now sets
  256 KiB, with which an idle ensemble stops growing after four minutes.
  `python embedded_ros/benchmarks/receive_buffer.py` shows both sizes, with CycloneDDS alone.
- **A leak.** CycloneDDS's Python layer never frees its copy of an endpoint's user data. This lost
  97 bytes each time that a node asked who publishes a topic; skill server and planner ask for every
  skill and task. embedded_ros now asks once per endpoint.
- **Free lists.** CPython keeps freed tuples for later, up to 2000 of each length below 20, and
  4 MiB at most in all. `tuple(generator)` adds one each time. A full garbage collection, which is
  rare, gives them back. Python's memory of `perception_node` grew by 32 blocks per task without
  one, and not at all with one every five seconds.
- **The recorder's index** has an entry for every message in the current chunk of its bag, and one
  for each chunk before, because a closed bag ends with an index. With chunks of 64 KiB, as then,
  it grows by about a tenth of a KiB per task, as long as the recorder runs.

`slap_run` is the process that asks for the tasks. It does not leak either: with a full garbage
collection and `malloc_trim` after every 40 tasks it had 69.6 MiB after 40 and after 160 tasks, of
which C code had allocated 14.0 MiB. Another run had as many Python objects after 60 tasks as after
220. Without this, collector and allocator free memory late. It is not known where the growth ends:
1000 tasks were not enough to see it.

## How to make it again

    python -m benchmarks.soak --tasks {tasks} --output docs/results

All numbers: [soak.json](soak.json). The library's digest is `{digest}`.
"""


@dataclass(frozen=True)
class Sample:
    """The resources of a process."""

    memory_mib: float  # resident
    threads: int
    descriptors: int

    @classmethod
    def of(cls, process: psutil.Process) -> Sample:
        """Measure the resources of a process."""
        with process.oneshot():
            return cls(process.memory_info().rss / MIB, process.num_threads(), process.num_fds())


@dataclass(frozen=True)
class Soaked:
    """The samples and results of a run.

    Args:
        tasks: Number of tasks after which each sample was taken.
        samples: Samples of each node, by its name, in order of ``tasks``.
        solved: Number of tasks that were solved.
        seconds: Duration of the run, s.
        failures: Reasons of the tasks that were not solved.
    """

    tasks: Sequence[int]
    samples: Mapping[str, Sequence[Sample]]
    solved: int
    seconds: float
    failures: Sequence[str]

    def growth(self, node: str) -> float:
        """Growth of resident memory over the second half, KiB per task.

        The median slope over pairs of samples (Theil and Sen's), as whole libraries' pages come and
        go in steps.
        """
        half = len(self.tasks) // 2
        memory = [sample.memory_mib * 1024 for sample in self.samples[node][half:]]
        pairs = combinations(zip(self.tasks[half:], memory, strict=True), 2)
        slopes = [(later - before) / (end - begin) for (begin, before), (end, later) in pairs]
        return float(np.median(slopes)) if slopes else 0.0

    def as_json(self) -> dict[str, Any]:
        """The run as JSON data."""
        return {
            "solved": self.solved,
            "seconds": round(self.seconds, 1),
            "failures": list(self.failures),
            "tasks": list(self.tasks),
            "nodes": {
                node: {
                    "growth_kib_per_task": round(self.growth(node), 3),
                    **{key: [round(asdict(s)[key], 2) for s in samples] for key in PANELS},
                }
                for node, samples in self.samples.items()
            },
        }


class Bench:
    """The user of the ensemble."""

    def __init__(self, client: RunClient, spinner: Spinner) -> None:
        self._client, self._spinner = client, spinner
        self._resets = client.create_client(RESET_TASK.type, RESET_TASK.name)

    def ready(self) -> None:
        """Wait until the ensemble is."""
        self._wait(lambda: self._client.ready(True) and self._resets.service_is_ready())

    def solve(self, seed: int) -> str:
        """Have a task solved; empty, or why it was not."""
        self._client.log = RunLog()  # only one run is of interest at a time
        reset = self._resets.call_async(ResetTask.Request(seed=seed))
        self._wait(reset.done)
        sent = self._client.send((), 0, 5, reset.result().episode)
        self._wait(sent.done)
        ended = sent.result().get_result_async()
        self._wait(ended.done)
        result = ended.result().result
        return "" if result.success else f"seed {seed}: {result.error_code}: {result.error_msg}"

    def _wait(self, condition: Any) -> None:
        if not self._spinner.spin_until(condition, PATIENCE):
            raise SystemExit(f"no answer within {PATIENCE} s")


def soak(tasks: int, every: int) -> Soaked:
    """Solve tasks with seeds from 0 on, reading the processes after every so many."""
    with (
        TemporaryDirectory(prefix="slap-soak-") as folder,
        temporary_node(lambda: RunClient(lambda _type, _message: None)) as (client, spinner),
        ExitStack() as stack,
    ):
        bag = Path(folder) / "bag"
        settings = RunSettings(DomainChoice(DOMAIN, "fair"), 0, 0, "lazy", bag)
        launcher = stack.enter_context(ProcessLauncher(node_parameters(settings)))
        spinner.check = launcher.check
        bench = Bench(client, spinner)
        bench.ready()
        processes = {name: psutil.Process(p.pid) for name, p in launcher.processes.items()}
        processes["slap_run"] = psutil.Process()
        read: dict[str, list[Sample]] = {name: [] for name in processes}
        after, failures, start = [], [], monotonic()
        with counting_bars() as bar:
            line = bar.add_task("soaking", total=tasks)
            for number in range(1, tasks + 1):
                if failure := bench.solve(number - 1):
                    failures.append(failure)
                    bar.console.print(failure, highlight=False)
                if number == 1 or number % every == 0 or number == tasks:
                    after.append(number)
                    for name, process in processes.items():
                        read[name].append(Sample.of(process))
                bar.advance(line)
        return Soaked(after, read, tasks - len(failures), monotonic() - start, failures)


def draw(figure: Figure, soaked: Soaked) -> None:
    """A panel each for memory, threads and descriptors; a line a process."""
    panels = figure.subplots(len(PANELS), 1, sharex=True, height_ratios=(2, 1, 1))
    for axes, (key, label) in zip(panels, PANELS.items(), strict=True):
        for (node, samples), colour in zip(soaked.samples.items(), LINES, strict=True):
            values = [getattr(sample, key) for sample in samples]
            axes.plot(soaked.tasks, values, color=colour, linewidth=1.2, label=node)
        axes.set_ylim(bottom=0)
        axes.locator_params(axis="y", integer=True)
        axes.set_ylabel(label)
    panels[-1].set_xlabel("tasks")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)


def table(soaked: Soaked) -> MarkdownTable:
    """The table with one row per process."""
    rows = []
    for node, samples in soaked.samples.items():
        middle = samples[len(samples) // 2]
        spans = [
            f"{min(v)} to {max(v)}" if min(v) < max(v) else f"{max(v)}"
            for v in ([s.threads for s in samples[1:]], [s.descriptors for s in samples[1:]])
        ]
        memory = [f"{s.memory_mib:.1f}" for s in (samples[0], middle, samples[-1])]
        rows.append([f"`{node}`", *memory, f"{soaked.growth(node):.2f}", *spans])
    return MarkdownTable(
        [
            "process",
            "memory after 1 task [MiB]",
            "half-way",
            "at the end",
            "growth [KiB per task]",
            "threads",
            "descriptors",
        ],
        rows,
    )


def _library() -> dict[str, Any]:
    """The library that the ensemble plans with: the one that ships."""
    path = shipped_library(DOMAIN)
    assert path is not None
    return describe_library(DOMAIN, load_library(path, get_domain(DOMAIN)))


def write(folder: Path, soaked: Soaked) -> None:
    """Write the page, the picture and the numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    library = _library()
    page = PAGE.format(
        tasks=soaked.tasks[-1],
        domain=DOMAIN,
        solved=soaked.solved,
        minutes=soaked.seconds / 60,
        table=table(soaked).as_markdown(),
        digest=library["digest"],
    )
    data = {
        "domain": DOMAIN,
        "library": library,
        "versions": dict(versions()),
        "found": soaked.as_json(),
    }
    drawing = picture(lambda figure: draw(figure, soaked), SIZE)
    for ending, content in {"md": page, "json": pretty_json(data) + "\n", "svg": drawing}.items():
        (folder / f"soak.{ending}").write_text(content, encoding="utf-8")


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--every", type=int, default=10, help="tasks between two samples")
    parser.add_argument("--output", type=Path, help="folder for page, picture and numbers")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if arguments.output is not None:
        require_matplotlib()
    soaked = soak(arguments.tasks, arguments.every)
    if arguments.output is not None:
        write(arguments.output, soaked)
    if arguments.json:
        show(soaked.as_json(), as_json=True)
    else:
        print(f"{soaked.solved} of {arguments.tasks} solved in {soaked.seconds:.0f} s")
        print(table(soaked).as_markdown())
    return 1 if soaked.failures else 0


if __name__ == "__main__":
    sys.exit(main())
