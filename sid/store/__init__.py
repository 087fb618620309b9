"""Results on the disk, whole or not at all, and the tables that people give."""

from sid.store.arrays import (
    content_hash,
    read_array,
    read_eigenvalues,
    read_matrix,
    read_near,
    read_signature,
    read_spectrum,
    read_spectrum_of,
    write_array,
    write_json,
    write_matrix,
    write_near,
    write_signatures,
    write_spectrum,
)
from sid.store.atomic import (
    replacing,
)
from sid.store.figures import (
    write_figure,
)
from sid.store.file_hashes import (
    FileHashes,
)
from sid.store.mesh_set import (
    MeshSet,
    find_mesh_set,
    read_mesh_set,
    show_name,
)
from sid.store.points import (
    line,
    read_candidates,
    read_copy,
    read_ground_truth,
    read_marks,
    read_points,
    write_candidates,
    write_ground_truth,
    write_points,
)
from sid.store.run import (
    read_run,
)
from sid.store.surfaces import (
    read_surface,
    write_surface,
)
from sid.store.tables import (
    read_irregularity,
    read_scores,
    read_table,
    write_frame,
    write_irregularity,
    write_table,
)

__all__ = [
    "FileHashes",
    "MeshSet",
    "read_array",
    "read_near",
    "read_run",
    "write_near",
    "find_mesh_set",
    "content_hash",
    "read_candidates",
    "read_surface",
    "read_copy",
    "read_eigenvalues",
    "read_ground_truth",
    "read_irregularity",
    "line",
    "read_marks",
    "read_matrix",
    "read_mesh_set",
    "read_points",
    "read_scores",
    "read_signature",
    "read_spectrum",
    "read_spectrum_of",
    "read_table",
    "replacing",
    "show_name",
    "write_array",
    "write_candidates",
    "write_surface",
    "write_figure",
    "write_frame",
    "write_ground_truth",
    "write_irregularity",
    "write_json",
    "write_matrix",
    "write_points",
    "write_signatures",
    "write_spectrum",
    "write_table",
]
