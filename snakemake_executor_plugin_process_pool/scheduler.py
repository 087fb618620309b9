"""What a workflow may ask of Snakemake's scheduler, whatever the executor; to be called from a Snakefile.

Snakemake has no public door for these. Names that are used, tried on 9.0.0 and 9.27.1:
``workflow.scheduler.exit_gracefully``, ``workflow.local_exec``, ``workflow.register_resource``,
``workflow.global_resources``, ``workflow.group_settings``, ``DAG.update_ready``, ``DAG._ready``,
``DAG._check_groups``, ``common.get_function_params``, ``Job.format_wildcards``, ``Job._format_wildcards``,
``utils.format``; on 9.27.1 alone ``FilePersistence._write_record``, ``._io_write``, ``._record_path``,
``._incomplete_path`` and ``._metadata_path``.
"""

import atexit
import gc
import os
import threading
from collections.abc import MutableMapping
from contextlib import suppress
from functools import cache, wraps
from string import Formatter
from types import FunctionType, MethodType
from weakref import WeakKeyDictionary


def start_no_more_jobs(workflow) -> None:
    """Let the jobs that run come to their end, and the run then end with an error.

    Snakemake does the same on the signal SIGTERM, but waits for ever where that comes while it notes the end
    of a job. So does a call from the thread that does this: it is made from one of its own.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        While it runs.
    """
    threading.Thread(target=workflow.scheduler.exit_gracefully).start()


def limit_memory(workflow, megabytes: int) -> int | None:
    """Have a job wait while its ``mem_mb`` and those of the running jobs exceed the memory of this machine.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        While its Snakefile is read.
    megabytes : int
        Memory of this machine.

    Returns
    -------
    int or None
        The limit: that of ``--resources mem_mb`` where the user gave one, else that of the machine. None
        where jobs run elsewhere; nothing is limited then.
    """
    if not workflow.local_exec:
        return None
    given = workflow.global_resources.get("mem_mb")
    given = getattr(given, "value", given)  # a number itself in the first versions
    if isinstance(given, int):
        return given
    workflow.register_resource("mem_mb", megabytes)
    return megabytes


def parts_of_a_job(workflow, rule: str) -> int:
    """How many connected parts of a rule's group are one job, by ``--groups`` and ``--group-components``.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        From when it plans its jobs on; while its Snakefile is read it does not know yet, and 1 is returned.
    rule : str
        Name of the rule.

    Returns
    -------
    int
        1 as well where the rule is in no group.
    """
    settings = workflow.group_settings
    return settings.group_components.get(settings.overwrite_groups.get(rule), 1)


def look_at_each_group_once() -> None:
    """Have Snakemake look once at each group of jobs, not once for each job of the group.

    Whether a group is ready, it asks for each job of it, goes through all jobs of the group for an answer,
    and at each of what they depend on compares the group with itself, job by job: the cube of their number.
    Whether a group depends on itself, it asks as often: the square. A thousand meshes in groups of a hundred
    were not submitted within ten minutes. The answer is one for all jobs of a group, and nothing that it
    depends on changes while Snakemake goes through them. A second call changes nothing, and neither does the
    first where Snakemake does this in another way.
    """
    from snakemake.dag import DAG

    try:
        update_ready, is_ready, check_groups = DAG.update_ready, DAG._ready, DAG._check_groups
    except AttributeError:  # of a later version
        return
    if hasattr(update_ready, "__wrapped__"):
        return

    @wraps(update_ready)
    def update(self, jobs=None):
        self._ready_groups = {}
        return update_ready(self, jobs)

    @wraps(is_ready)
    def ask(self, job):
        group = self._group.get(job)
        if group is None:
            return is_ready(self, job)
        if id(group) not in self._ready_groups:
            self._ready_groups[id(group)] = all(
                self._n_until_ready[one]
                == sum(self._group.get(each) is group for each in self._dependencies[one])
                for one in group
            )
        return self._ready_groups[id(group)]

    @wraps(check_groups)
    def check(self):
        group_of_job = self._group
        self._group = {id(group): group for group in group_of_job.values()}
        try:
            check_groups(self)
        finally:
            self._group = group_of_job

    DAG.update_ready, DAG._ready, DAG._check_groups = update, ask, check


def turn_marks_into_records() -> None:
    """Have Snakemake turn the mark of an unfinished result into the record of the finished one.

    It writes a file as the mark, another one as the record, and deletes the first. ext4 gives the place of a
    deleted file to no other for one to five minutes, and looks past all of them for each new file: with a
    thousand meshes for a fifth of the time of Snakemake's own process. Here the record is written into the
    mark, which then takes the record's name. A mark that stands means what it meant: a run that is killed
    before the last one of a job is renamed runs the job again. A second call changes nothing, and neither
    does the first where Snakemake does this in another way.
    """
    try:
        from snakemake.persistence.file import FilePersistence

        write_record, write = FilePersistence._write_record, FilePersistence._io_write
        path_of = FilePersistence._record_path
    except (ImportError, AttributeError):  # of an earlier version, or a later one
        return
    if hasattr(write_record, "__wrapped__"):
        return

    @wraps(write_record)
    def move(self, key, record):
        mark, place = (path_of(self, folder, key) for folder in (self._incomplete_path, self._metadata_path))
        # a key too long for one name has folders of its own, which Snakemake removes with the mark
        if os.path.dirname(mark) != str(self._incomplete_path) or not os.path.isfile(mark):
            write_record(self, key, record)
            return
        write(self, self._incomplete_path, dict(record.items()), key)
        os.replace(mark, place)

    FilePersistence._write_record = move


def look_through_memory_less_often() -> None:
    """Have the garbage collector leave alone what Snakemake keeps until its end: modules, and the plan.

    While Snakemake plans its jobs the collector looks again and again through all that has been imported, and
    at the end of the process through all jobs, only for the system to take the memory back. A second call
    does no harm.

    Examples
    --------
    >>> look_through_memory_less_often()
    >>> gc.get_freeze_count() > 1000
    True
    """
    gc.freeze()
    atexit.unregister(gc.freeze)
    atexit.register(gc.freeze)


def remember_parameters() -> None:
    """Have Snakemake ask once for the parameters of a function, not for each job again.

    It asks for those of the functions of a Snakefile that tell memory, time and threads, and of its own
    around them. They stay what they are. A second call changes nothing, and neither does the first where
    Snakemake does this in another way.

    Examples
    --------
    >>> remember_parameters()
    >>> from snakemake.common import get_function_params
    >>> list(get_function_params(lambda wildcards, threads: 1))
    ['wildcards', 'threads']
    """
    try:
        from snakemake import common, jobs, rules

        ask = common.get_function_params
    except (ImportError, AttributeError):  # of a later version
        return
    if hasattr(ask, "__wrapped__"):
        return
    known: dict[bool, MutableMapping] = {False: WeakKeyDictionary(), True: WeakKeyDictionary()}

    @wraps(ask)
    def remember(func):
        bound = isinstance(func, MethodType)  # made anew whenever it is taken from its object
        if not bound and not isinstance(func, FunctionType):  # it may have parameters that change
            return ask(func)
        key = func.__func__ if bound else func
        if key not in known[bound]:
            known[bound][key] = ask(func)
        return known[bound][key]

    for module in (common, jobs, rules):
        if getattr(module, "get_function_params", None) is ask:
            module.get_function_params = remember


def fill_in_wildcards_alone() -> None:
    """Have Snakemake write a rule's message from the wildcards alone where it names nothing else.

    It copies all names of the Snakefiles and of one of its own modules for each message. A message that names
    something else, or that cannot be written, is left to it. A second call changes nothing, and neither does
    the first where Snakemake does this in another way.

    Examples
    --------
    >>> fill_in_wildcards_alone()
    >>> from snakemake.jobs import Job
    >>> hasattr(Job.format_wildcards, "__wrapped__")
    True
    """
    try:
        from snakemake.jobs import Job
        from snakemake.utils import format as fill_in

        format_wildcards = Job.format_wildcards
    except (ImportError, AttributeError):  # of a later version
        return
    if hasattr(format_wildcards, "__wrapped__"):
        return

    @cache
    def names_wildcards_alone(text):
        fields = [(name, form or "") for _, name, form, _ in Formatter().parse(text) if name is not None]
        return all(name.startswith("wildcards.") and "{" not in form for name, form in fields)

    @wraps(format_wildcards)
    def write(self, string, **variables):
        with suppress(Exception):
            if not variables and names_wildcards_alone(string):
                # the parameters are worked out here, as by Snakemake: what fails in them ends the run
                return fill_in(string, wildcards=self._format_wildcards, params=self.params)
        return format_wildcards(self, string, **variables)

    Job.format_wildcards = write
