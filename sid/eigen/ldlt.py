"""Sparse LDL^T of a symmetric matrix, compiled by numba: multifrontal, unpivoted, blocks of right-hand sides.

Supernodes are dense panels stored row by row, so that the fronts are factorised by matrix products, and a
solve streams the factor once for eight right-hand sides, which lie contiguous in each row. See Duff and Reid,
"The multifrontal solution of indefinite sparse symmetric linear equations" (1983); Gilbert, Ng and Peyton,
"An efficient algorithm to compute row and column counts for sparse Cholesky factorization" (1994).
"""

from dataclasses import dataclass

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

WIDTH = 8  # right-hand sides of one pass through the factor: one AVX-512 register, two of AVX2, four of NEON


@dataclass(frozen=True)
class Symbolic:
    """The structure of a factor: it depends on the pattern of the matrix only, and serves every shift.

    Attributes
    ----------
    order : (n,) int32
        Row ``i`` of the factor is row ``order[i]`` of the matrix.
    starts : (s + 1,) int64
        First column of each supernode.
    row_starts : (s + 1,) int64
        Where each supernode's rows below its diagonal block begin in ``rows``.
    rows : int32
        Those rows, ascending within a supernode.
    panel_starts : (s + 1,) int64
        Where each supernode's panel begins in the array of values.
    parents : (s,) int32
        Parent of each supernode in the assembly tree, -1 for a root.
    stack : int
        Values that the numeric factorisation holds at once beside the factor.

    Examples
    --------
    >>> from scipy import sparse
    >>> triangle = sparse.csc_array(np.ones((3, 3)))
    >>> symbolic = analyse(triangle.indptr, triangle.indices, np.arange(3))
    >>> symbolic.starts.tolist(), symbolic.size  # one dense panel
    ([0, 3], 9)
    """

    order: np.ndarray
    starts: np.ndarray
    row_starts: np.ndarray
    rows: np.ndarray
    panel_starts: np.ndarray
    parents: np.ndarray
    stack: int

    @property
    def size(self) -> int:
        """Number of values of the factor, zeros of merged supernodes included."""
        return int(self.panel_starts[-1])


def analyse(indptr: np.ndarray, indices: np.ndarray, order: np.ndarray) -> Symbolic:
    """Structure of the factor of a symmetric matrix under an ordering.

    Parameters
    ----------
    indptr, indices : int32
        Pattern of the matrix, both triangles, compressed by columns.
    order : (n,) int
        Fill-reducing ordering; it is refined to a postorder, which changes neither fill nor work.

    Returns
    -------
    Symbolic

    Examples
    --------
    >>> from scipy import sparse
    >>> edges = sparse.csc_array([[1.0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]])
    >>> symbolic = analyse(edges.indptr, edges.indices, np.arange(4))
    >>> symbolic.starts.tolist(), symbolic.parents.tolist()  # two components: each is a root
    ([0, 2, 4], [-1, -1])
    """
    return Symbolic(*_analyse(_int32(indptr), _int32(indices), _int32(order)))


def factorise(
    symbolic: Symbolic,
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
    panels: np.ndarray,
    stack: np.ndarray,
) -> np.ndarray:
    """Numeric factorisation of a symmetric matrix, already permuted by ``symbolic.order``.

    Parameters
    ----------
    symbolic : Symbolic
    indptr, indices, data
        The permuted matrix compressed by columns; only its lower triangle is read.
    panels : (symbolic.size,) float64
        Zeros; becomes the factor.
    stack : (symbolic.stack,) float64
        Memory to work in.

    Returns
    -------
    pivots : (n,) float64
        Their signs are the inertia. They are not finite from where the factorisation broke down.

    Examples
    --------
    >>> from scipy import sparse
    >>> matrix = sparse.csc_array([[1.0, 2.0], [2.0, 1.0]])  # eigenvalues 3 and -1
    >>> symbolic = analyse(matrix.indptr, matrix.indices, np.arange(2))
    >>> panels, stack = np.zeros(symbolic.size), np.empty(symbolic.stack)
    >>> pivots = factorise(symbolic, matrix.indptr, matrix.indices, matrix.data, panels, stack)
    >>> pivots.tolist()  # one of each sign, and their product is the determinant
    [1.0, -3.0]
    """
    pivots = np.full(len(indptr) - 1, np.nan)
    _factorise(
        symbolic.starts,
        symbolic.row_starts,
        symbolic.rows,
        symbolic.panel_starts,
        symbolic.parents,
        stack,
        _int32(indptr),
        _int32(indices),
        data,
        panels,
        pivots,
    )
    return pivots


def solve(symbolic: Symbolic, panels: np.ndarray, pivots: np.ndarray, right: np.ndarray) -> None:
    """Solve in place for ``WIDTH`` right-hand sides, in the factor's ordering.

    Parameters
    ----------
    symbolic : Symbolic
    panels : (symbolic.size,) float64
        The factor.
    pivots : (n,) float64
    right : (n, WIDTH) float64, C-contiguous
        Overwritten with the solution.

    Examples
    --------
    >>> from scipy import sparse
    >>> matrix = sparse.csc_array([[4.0, 2.0], [2.0, 3.0]])
    >>> symbolic = analyse(matrix.indptr, matrix.indices, np.arange(2))
    >>> panels, stack = np.zeros(symbolic.size), np.empty(symbolic.stack)
    >>> pivots = factorise(symbolic, matrix.indptr, matrix.indices, matrix.data, panels, stack)
    >>> right = np.ones((2, WIDTH))
    >>> solve(symbolic, panels, pivots, right)
    >>> right[:, 0].round(9).tolist()
    [0.125, 0.25]
    """
    _solve(symbolic.starts, symbolic.row_starts, symbolic.rows, symbolic.panel_starts, panels, pivots, right)


def touch(stretches: list[np.ndarray], stop: np.ndarray) -> None:
    """Write to memory for the first time, to two stretches at a time, until another thread stops it.

    Parameters
    ----------
    stretches : list of (m, n) float64, C-contiguous
        Each page of each is written to, row by row.
    stop : (1,) bool
        Looked at before each row, without Python's lock.

    Examples
    --------
    >>> rows, stop = np.ones((3, 1000)), np.zeros(1, dtype=bool)
    >>> touch([rows[:1], rows[2:]], stop)
    >>> rows[:, 0].tolist()
    [0.0, 1.0, 0.0]
    """
    pairs = zip(stretches[::2], [*stretches[1::2], stretches[0][:0]], strict=False)
    for first, second in pairs:
        _touch(first, second, stop)


def _int32(values: np.ndarray) -> np.ndarray:
    """One type of index, so that numba compiles once."""
    return np.ascontiguousarray(values, dtype=np.int32)


@njit(cache=True, nogil=True)
def _touch(first, second, stop):
    step = 512  # of eight bytes each, a page
    for row in range(max(len(first), len(second))):
        if stop[0]:
            return
        for rows in (first, second):
            if row < len(rows):
                for column in range(0, rows.shape[1], step):
                    rows[row, column] = 0.0


@njit(cache=True, nogil=True)
def _elimination_tree(indptr, indices, order, inverse):
    n = len(order)
    parent = np.full(n, -1, np.int32)
    ancestor = np.full(n, -1, np.int32)
    for j in range(n):
        column = order[j]
        for p in range(indptr[column], indptr[column + 1]):
            i = inverse[indices[p]]
            while i != -1 and i < j:
                up = ancestor[i]
                ancestor[i] = j
                if up == -1:
                    parent[i] = j
                i = up
    return parent


@njit(cache=True, nogil=True)
def _postorder(parent):
    n = len(parent)
    head = np.full(n, -1, np.int32)
    following = np.full(n, -1, np.int32)
    for j in range(n - 1, -1, -1):
        if parent[j] != -1:
            following[j] = head[parent[j]]
            head[parent[j]] = j
    post = np.empty(n, np.int32)
    stack = np.empty(n, np.int32)
    k = 0
    for root in range(n):
        if parent[root] != -1:
            continue
        top = 0
        stack[0] = root
        while top >= 0:
            j = stack[top]
            child = head[j]
            if child == -1:
                top -= 1
                post[k] = j
                k += 1
            else:
                head[j] = following[child]
                top += 1
                stack[top] = child
    return post


@njit(cache=True, nogil=True)
def _column_counts(indptr, indices, order, inverse, parent):
    """Entries of each column of the factor, diagonal included (Gilbert, Ng and Peyton); postordered."""
    n = len(order)
    first = np.full(n, -1, np.int32)
    count = np.zeros(n, np.int32)
    for k in range(n):
        j = k
        count[j] = 1 if first[j] == -1 else 0
        while j != -1 and first[j] == -1:
            first[j] = k
            j = parent[j]
    ancestor = np.arange(n).astype(np.int32)
    max_first = np.full(n, -1, np.int32)
    previous_leaf = np.full(n, -1, np.int32)
    for j in range(n):
        if parent[j] != -1:
            count[parent[j]] -= 1
        column = order[j]
        for p in range(indptr[column], indptr[column + 1]):
            i = inverse[indices[p]]
            if i <= j or first[j] <= max_first[i]:
                continue
            max_first[i] = first[j]
            previous = previous_leaf[i]
            previous_leaf[i] = j
            count[j] += 1
            if previous != -1:
                q = previous
                while q != ancestor[q]:
                    q = ancestor[q]
                s = previous
                while s != q:
                    up = ancestor[s]
                    ancestor[s] = q
                    s = up
                count[q] -= 1
        if parent[j] != -1:
            ancestor[j] = parent[j]
    for j in range(n):
        if parent[j] != -1:
            count[parent[j]] += count[j]
    return count


@njit(cache=True, nogil=True)
def _supernodes(parent, count):
    """First columns of supernodes, merged with their parents where that stores few zeros."""
    n = len(parent)
    starts = np.empty(n + 1, np.int64)
    zeros = np.zeros(n + 1, np.int64)
    starts[0] = 0
    merged = 0  # supernodes kept so far; the last one is open
    for j in range(1, n + 1):
        if j < n and parent[j - 1] == j and count[j - 1] == count[j] + 1:
            continue
        # columns starts[merged] .. j-1 are a supernode; merge it with those before it that hang below it
        starts[merged + 1] = j
        zeros[merged] = 0
        while merged > 0:
            low, mid, high = starts[merged - 1], starts[merged], starts[merged + 1]
            if parent[mid - 1] < mid or parent[mid - 1] >= high:
                break
            columns = high - low
            below = count[high - 1] - 1
            extra = (mid - low) * ((high - mid) + below - (count[mid - 1] - 1))
            total_zeros = zeros[merged - 1] + zeros[merged] + extra
            total = columns * (columns + 1) // 2 + columns * below
            share = total_zeros / total
            if (
                columns <= 8
                or (columns <= 16 and share < 0.3)
                or (columns <= 48 and share < 0.1)
                or share < 0.04
            ):
                starts[merged] = high
                zeros[merged - 1] = total_zeros
                merged -= 1
            else:
                break
        merged += 1
        starts[merged] = j
    return starts[: merged + 1].copy()


@njit(cache=True, nogil=True)
def _analyse(indptr, indices, order):
    n = len(order)
    inverse = np.empty(n, np.int32)
    for i in range(n):
        inverse[order[i]] = i
    parent = _elimination_tree(indptr, indices, order, inverse)
    post = _postorder(parent)
    order = order[post]
    for i in range(n):
        inverse[order[i]] = i
    rank = np.empty(n, np.int32)
    for i in range(n):
        rank[post[i]] = i
    relabelled = np.full(n, -1, np.int32)
    for i in range(n):
        if parent[post[i]] != -1:
            relabelled[i] = rank[parent[post[i]]]
    parent = relabelled
    count = _column_counts(indptr, indices, order, inverse, parent)
    starts = _supernodes(parent, count)
    number = len(starts) - 1

    owner = np.empty(n, np.int32)
    row_starts = np.zeros(number + 1, np.int64)
    panel_starts = np.zeros(number + 1, np.int64)
    for s in range(number):
        owner[starts[s] : starts[s + 1]] = s
        below = count[starts[s + 1] - 1] - 1
        columns = starts[s + 1] - starts[s]
        row_starts[s + 1] = row_starts[s] + below
        panel_starts[s + 1] = panel_starts[s] + (columns + below) * columns
    rows = np.empty(row_starts[number], np.int32)
    parents = np.full(number, -1, np.int32)
    head = np.full(number, -1, np.int32)
    following = np.full(number, -1, np.int32)
    mark = np.full(n, -1, np.int32)
    pending = 0  # values of update matrices on the stack
    highest = 0
    for s in range(number):
        low, high = starts[s], starts[s + 1]
        k = row_starts[s]
        for j in range(low, high):
            column = order[j]
            for p in range(indptr[column], indptr[column + 1]):
                i = inverse[indices[p]]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    rows[k] = i
                    k += 1
        child = head[s]
        freed = 0
        while child != -1:
            for q in range(row_starts[child], row_starts[child + 1]):
                i = rows[q]
                if i >= high and mark[i] != s:
                    mark[i] = s
                    rows[k] = i
                    k += 1
            size = row_starts[child + 1] - row_starts[child]
            freed += size * size
            child = following[child]
        mine = rows[row_starts[s] : row_starts[s + 1]]
        mine.sort()
        below = len(mine)
        # the new update matrix stands above its children's before it takes their place
        highest = max(highest, pending + below * below)
        pending += below * below - freed
        if below > 0:
            t = owner[mine[0]]
            parents[s] = t
            following[s] = head[t]
            head[t] = s
    return order, starts, row_starts, rows, panel_starts, parents, highest


@njit(cache=True, nogil=True)
def _factorise_block(panel, low, high, pivots, first, transposed):
    """LDL^T of columns low..high of a panel, whose earlier columns were already eliminated."""
    rows = panel.shape[0]
    for i in range(low, rows):
        row = panel[i]
        last = min(i, high)
        for t in range(low, last):
            value = row[t]
            if value == 0.0:
                continue
            line = transposed[t - low]
            for u in range(t + 1, last):
                row[u] -= value * line[u - low]
        if i < high:
            pivot = row[i]
            for t in range(low, i):
                scaled = row[t] / pivots[first + t]
                pivot -= row[t] * scaled
                transposed[t - low, i - low] = scaled
                row[t] = scaled
            if pivot == 0.0 or not np.isfinite(pivot):
                return False
            pivots[first + i] = pivot
            row[i] = 1.0
        else:
            for t in range(low, high):
                row[t] /= pivots[first + t]
    return True


@njit(cache=True, nogil=True)
def _factorise_panel(panel, pivots, first, transposed):
    """LDL^T of a panel (columns + rows below, columns), block by block of columns."""
    rows, columns = panel.shape
    block = transposed.shape[0]
    for low in range(0, columns, block):
        high = min(low + block, columns)
        if not _factorise_block(panel, low, high, pivots, first, transposed):
            return False
        if high < columns:
            left = panel[high:, low:high].copy()
            right = panel[high:columns, low:high] * pivots[first + low : first + high]
            update = np.dot(left, right.T)
            for i in range(rows - high):
                for j in range(min(i + 1, columns - high)):
                    panel[high + i, high + j] -= update[i, j]
    return True


@njit(cache=True, nogil=True)
def _factorise(starts, row_starts, rows, panel_starts, parents, stack, indptr, indices, data, panels, pivots):
    number = len(starts) - 1
    n = starts[number]
    place = np.zeros(number, np.int64)  # where each pending update matrix begins
    head = np.full(number, -1, np.int32)
    following = np.full(number, -1, np.int32)
    position = np.zeros(n, np.int32)
    transposed = np.zeros((48, 48))
    top = 0
    widest = 0
    for s in range(number):
        widest = max(widest, row_starts[s + 1] - row_starts[s])
    relative = np.empty(widest, np.int32)
    for s in range(number):
        low, high = starts[s], starts[s + 1]
        columns = high - low
        below = row_starts[s + 1] - row_starts[s]
        panel = panels[panel_starts[s] : panel_starts[s + 1]].reshape((columns + below, columns))
        for q in range(below):
            position[rows[row_starts[s] + q]] = columns + q
        for j in range(low, high):
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                if i >= j:
                    panel[i - low if i < high else position[i], j - low] += data[p]
        bottom = top
        child = head[s]
        while child != -1:
            size = row_starts[child + 1] - row_starts[child]
            update = stack[place[child] : place[child] + size * size].reshape((size, size))
            bottom = min(bottom, place[child])
            inside = 0
            for q in range(size):
                i = rows[row_starts[child] + q]
                if i < high:
                    relative[q] = i - low
                    inside += 1
                else:
                    relative[q] = position[i]
            for a in range(size):
                for b in range(min(a + 1, inside)):
                    panel[relative[a], relative[b]] += update[a, b]
            child = following[child]
        if not _factorise_panel(panel, pivots, low, transposed):
            return
        if below == 0:
            top = bottom
            continue
        own = stack[top : top + below * below].reshape((below, below))
        lower = panel[columns:]
        if columns < 4 and below < 64:
            for a in range(below):
                for b in range(a + 1):
                    value = 0.0
                    for t in range(columns):
                        value -= lower[a, t] * pivots[low + t] * lower[b, t]
                    own[a, b] = value
        else:
            scaled = lower * (-pivots[low:high])
            if below <= 192:
                np.dot(scaled, lower.T, own)
            else:  # only the blocks that touch the lower triangle
                for a in range(0, below, 128):
                    end = min(a + 128, below)
                    own[a:end, :end] = np.dot(scaled[a:end], lower[:end].T)
        child = head[s]
        while child != -1:
            size = row_starts[child + 1] - row_starts[child]
            update = stack[place[child] : place[child] + size * size].reshape((size, size))
            inside = 0
            for q in range(size):
                i = rows[row_starts[child] + q]
                if i < high:
                    inside += 1
                else:
                    relative[q] = position[i] - columns
            for a in range(inside, size):
                line = own[relative[a]]
                for b in range(inside, a + 1):
                    line[relative[b]] += update[a, b]
            child = following[child]
        if bottom < top:
            stack[bottom : bottom + below * below] = stack[top : top + below * below]
        place[s] = bottom
        top = bottom + below * below
        parent = parents[s]
        following[s] = head[parent]
        head[parent] = s


def _pointer(context, builder, kind, value):
    return context.make_array(kind)(context, builder, value).data


def _vector_at(builder, data, row, vector):
    """Address of row ``row`` of an (n, WIDTH) array, as a vector."""
    offset = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(data, [offset]), vector.as_pointer())


def _splat(builder, scalar, vector):
    zero = ir.Constant(ir.IntType(32), 0)
    single = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, zero)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), mask)


def _gather_kernel(height):
    """``right[targets[t + i]] -= sum_j values[start + i * stride + j] * right[first + j]`` for i < height.

    The compiler does not vectorise over the right-hand sides by itself, so the loop is written in vectors.
    """

    @intrinsic
    def kernel(typing, values, start, stride, number, right, first, targets, t):
        signature = types.void(values, start, stride, number, right, first, targets, t)

        def generate(context, builder, sig, args):
            long = ir.IntType(64)
            vector = ir.VectorType(ir.DoubleType(), WIDTH)
            values, right = (_pointer(context, builder, sig.args[k], args[k]) for k in (0, 4))
            targets = _pointer(context, builder, sig.args[6], args[6])
            start, stride, number, first, t = (args[k] for k in (1, 2, 3, 5, 7))
            sums = [
                cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * WIDTH)) for _ in range(height)
            ]
            for total in sums:
                builder.store(ir.Constant(vector, [0.0] * WIDTH), total)
            lines = [
                builder.gep(values, [builder.add(start, builder.mul(stride, long(i)))]) for i in range(height)
            ]
            with cgutils.for_range(builder, number, intp=long) as loop:
                row = _vector_at(builder, right, builder.add(first, loop.index), vector)
                x = builder.load(row, align=8)
                for total, line in zip(sums, lines, strict=True):
                    scalar = builder.load(builder.gep(line, [loop.index]))
                    product = builder.fmul(_splat(builder, scalar, vector), x, flags=("contract",))
                    builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
            for i, total in enumerate(sums):
                target = builder.load(builder.gep(targets, [builder.add(t, long(i))]))
                row = _vector_at(builder, right, builder.sext(target, long), vector)
                builder.store(builder.fsub(builder.load(row, align=8), builder.load(total)), row, align=8)
            return context.get_dummy_value()

        return signature, generate

    return kernel


def _scatter_kernel(height):
    """``right[first + j] -= sum_i values[start + i * stride + j] * right[sources[t + i]]`` for i < height."""

    @intrinsic
    def kernel(typing, values, start, stride, number, right, first, sources, t):
        signature = types.void(values, start, stride, number, right, first, sources, t)

        def generate(context, builder, sig, args):
            long = ir.IntType(64)
            vector = ir.VectorType(ir.DoubleType(), WIDTH)
            values, right = (_pointer(context, builder, sig.args[k], args[k]) for k in (0, 4))
            sources = _pointer(context, builder, sig.args[6], args[6])
            start, stride, number, first, t = (args[k] for k in (1, 2, 3, 5, 7))
            xs = []
            for i in range(height):
                source = builder.load(builder.gep(sources, [builder.add(t, long(i))]))
                row = _vector_at(builder, right, builder.sext(source, long), vector)
                xs.append(builder.load(row, align=8))
            lines = [
                builder.gep(values, [builder.add(start, builder.mul(stride, long(i)))]) for i in range(height)
            ]
            with cgutils.for_range(builder, number, intp=long) as loop:
                row = _vector_at(builder, right, builder.add(first, loop.index), vector)
                total = builder.load(row, align=8)
                for x, line in zip(xs, lines, strict=True):
                    scalar = builder.load(builder.gep(line, [loop.index]))
                    product = builder.fmul(_splat(builder, scalar, vector), x, flags=("contract",))
                    total = builder.fsub(total, product, flags=("contract",))
                builder.store(total, row, align=8)
            return context.get_dummy_value()

        return signature, generate

    return kernel


_gather_1, _gather_4 = _gather_kernel(1), _gather_kernel(4)
_scatter_1, _scatter_4 = _scatter_kernel(1), _scatter_kernel(4)


@njit(cache=True, nogil=True)
def _solve(starts, row_starts, rows, panel_starts, panels, pivots, right):
    number = len(starts) - 1
    own = np.empty(1, np.int32)
    for s in range(number):
        low = starts[s]
        columns = starts[s + 1] - low
        base = panel_starts[s]
        for i in range(1, columns):
            own[0] = low + i
            _gather_1(panels, base + i * columns, columns, i, right, low, own, 0)
        base += columns * columns
        t, end = row_starts[s], row_starts[s + 1]
        while t + 4 <= end:
            _gather_4(panels, base, columns, columns, right, low, rows, t)
            base += 4 * columns
            t += 4
        while t < end:
            _gather_1(panels, base, columns, columns, right, low, rows, t)
            base += columns
            t += 1
    for s in range(number - 1, -1, -1):
        low = starts[s]
        columns = starts[s + 1] - low
        for i in range(low, low + columns):
            scale = 1.0 / pivots[i]
            for r in range(WIDTH):
                right[i, r] *= scale
        base = panel_starts[s] + columns * columns
        t, end = row_starts[s], row_starts[s + 1]
        while t + 4 <= end:
            _scatter_4(panels, base, columns, columns, right, low, rows, t)
            base += 4 * columns
            t += 4
        while t < end:
            _scatter_1(panels, base, columns, columns, right, low, rows, t)
            base += columns
            t += 1
        base = panel_starts[s]
        for i in range(columns - 1, 0, -1):
            own[0] = low + i
            _scatter_1(panels, base + i * columns, columns, i, right, low, own, 0)


_INT32, _INT64, _FLOAT64 = (types.Array(kind, 1, "C") for kind in (types.int32, types.int64, types.float64))
_STRUCTURE = (_INT64, _INT64, _INT32, _INT64)
_FACTOR = (_FLOAT64, _FLOAT64)
COMPILED = [
    (_analyse, (_INT32, _INT32, _INT32)),
    (_factorise, (*_STRUCTURE, _INT32, _FLOAT64, _INT32, _INT32, _FLOAT64, *_FACTOR)),
    (_solve, (*_STRUCTURE, *_FACTOR, types.Array(types.float64, 2, "C"))),
]
