"""Executor ``slurm-pool`` of Snakemake: jobs of SLURM whose scripts run in a pool of processes.

The executor ``slurm`` of the package ``snakemake-executor-plugin-slurm`` submits a job that starts Snakemake
on the node, which starts it a second time under ``srun``, which starts Python for each script. This one
submits in the same way, by that package's classes; on the node one Snakemake runs with the executor
``process-pool``. So a group of a hundred small meshes starts Python a few times.

What a retry does again, and what one failure costs, stands in
`snakemake_executor_plugin_process_pool.submitted`.

Settings are those of ``slurm`` with the prefix ``slurm-pool-``, and ``slurm-pool-preload``.
"""

from importlib.util import find_spec

if find_spec("snakemake_executor_plugin_slurm"):
    from .executor import Executor, ExecutorSettings, common_settings
else:  # Snakemake imports all plugins that it finds
    from .missing import Executor, ExecutorSettings, common_settings

__all__ = ["Executor", "ExecutorSettings", "common_settings"]
