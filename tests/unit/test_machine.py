import os

from sid import machine


def test_memory_is_the_least_of_machine_container_and_slurm(tmp_path, monkeypatch):
    monkeypatch.delenv("SLURM_MEM_PER_NODE", raising=False)
    monkeypatch.setattr(machine, "LIMITS", (str(tmp_path / "max"), str(tmp_path / "missing")))
    whole = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    (tmp_path / "max").write_text("max\n")
    assert machine.memory() == whole
    (tmp_path / "max").write_text("50000000\n")
    assert machine.memory() == 50_000_000
    monkeypatch.setenv("SLURM_MEM_PER_NODE", "16")
    assert machine.memory() == 16 * 2**20
