"""Compiled Kalman filter and Rauch-Tung-Striebel smoother of an integrated random walk.

The state is (x, x', ..., x^(n-1)), n = 2, 3 or 4, and x^(n) is white noise of intensity q. Between nodes a time h apart
x^(i) becomes the sum of h^(j-i) / (j-i)! x^(j) over j >= i, and the noise adds the covariance

    Q_ij = q h^(2n-1-i-j) / ((2n-1-i-j) (n-1-i)! (n-1-j)!).

``q[k]`` is the intensity on the way into node k. A node is a sample (finite variance ``r`` of its value) or a place
between samples (``r`` infinite). ``jump[k]`` is the lowest derivative that may jump on the way into node k (n: none):
its variance and those above it grow by ``wide``.
Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445-1450; Bar-Shalom, Li and Kirubarajan, Estimation with
Applications to Tracking and Navigation (2001), Sections 6.2 and 8.6.
"""

from __future__ import annotations

from math import isfinite, log, sqrt

from nonsmooth.kernels.compile.cache import inline, kernel


@inline
def fill_step(n, h, q, F, Q):
    """Transition matrix and noise covariance of a step h."""
    for i in range(n):
        for j in range(n):
            F[i, j] = 0.0
        F[i, i] = 1.0
        for j in range(i + 1, n):
            F[i, j] = F[i, j - 1] * h / (j - i)
    for i in range(n):
        for j in range(i, n):
            power = 2 * n - 1 - i - j
            value = q / power
            for _ in range(power):
                value *= h
            for k in range(2, n - i):
                value /= k
            for k in range(2, n - j):
                value /= k
            Q[i, j] = value
            Q[j, i] = value


@inline
def predict(n, F, Q, u, P, u_next, P_next, work):
    """u_next = F u and P_next = F P F^T + Q."""
    for i in range(n):
        total = 0.0
        for k in range(i, n):
            total += F[i, k] * u[k]
        u_next[i] = total
        for j in range(n):
            total = 0.0
            for k in range(i, n):
                total += F[i, k] * P[k, j]
            work[i, j] = total
    for i in range(n):
        for j in range(i, n):
            total = Q[i, j]
            for k in range(j, n):
                total += work[i, k] * F[j, k]
            P_next[i, j] = total
            P_next[j, i] = total


@inline
def run_filter(n, step, y, r, jump, wide, q, u, P, work, sums):
    F, Q, W = work[0], work[1], work[2]
    u_p, u_f, P_p, P_f = u[0], u[1], P[0], P[1]
    sums[0] = 0.0
    sums[1] = 0.0
    for k in range(len(step)):
        if k == 0:
            for i in range(n):
                u_p[0, i] = y[0] if i == 0 else 0.0
                for j in range(n):
                    P_p[0, i, j] = wide[i] if i == j else 0.0
        else:
            fill_step(n, step[k], q[k], F, Q)
            predict(n, F, Q, u_f[k - 1], P_f[k - 1], u_p[k], P_p[k], W)
            for i in range(jump[k], n):
                P_p[k, i, i] += wide[i]
        if isfinite(r[k]):
            S = P_p[k, 0, 0] + r[k]
            e = y[k] - u_p[k, 0]
            sums[0] += e * e / S
            sums[1] += log(S)
            for i in range(n):
                gain = P_p[k, i, 0] / S
                u_f[k, i] = u_p[k, i] + gain * e
                W[0, i] = gain
            # P - K S K^T in Joseph's form, which cannot lose its sign: (I - K h) P (I - K h)^T + K r K^T.
            for i in range(n):
                for j in range(i, n):
                    a, b = W[0, i], W[0, j]
                    value = P_p[k, i, j] - a * P_p[k, 0, j] - b * P_p[k, i, 0] + a * b * S
                    P_f[k, i, j] = value
                    P_f[k, j, i] = value
        else:
            for i in range(n):
                u_f[k, i] = u_p[k, i]
                for j in range(n):
                    P_f[k, i, j] = P_p[k, i, j]


@kernel(
    "void(int64, float64[::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[::1], "
    "float64[:, :, ::1], float64[:, :, :, ::1], float64[:, :, ::1], float64[::1])"
)
def filter_nodes(n, step, y, r, jump, wide, q, u, P, work, sums):
    """Predicted [0] and filtered [1] states and covariances of all nodes; ``sums`` becomes (sum e^2/S, sum log S)."""
    # A number of states that the compiler knows lets it write the loops out: a quarter of the time.
    if n == 4:
        run_filter(4, step, y, r, jump, wide, q, u, P, work, sums)
    elif n == 3:
        run_filter(3, step, y, r, jump, wide, q, u, P, work, sums)
    else:
        run_filter(n, step, y, r, jump, wide, q, u, P, work, sums)


@kernel("void(int64, float64[::1], float64[::1], float64[:, :, ::1], float64[:, :, :, ::1], float64[:, :, ::1])")
def smooth_nodes(n, step, q, u, P, work):
    """Turn the filtered states and covariances into smoothed ones, from the last node back."""
    u_p, u_f, P_p, P_f = u[0], u[1], P[0], P[1]
    F, Q, C, G, D = work[0], work[1], work[2], work[3], work[4]
    for k in range(len(step) - 2, -1, -1):
        fill_step(n, step[k + 1], q[k + 1], F, Q)
        ahead = P_p[k + 1]
        for j in range(n):  # Cholesky factor of the predicted covariance
            for i in range(j, n):
                total = ahead[i, j]
                for m in range(j):
                    total -= C[i, m] * C[j, m]
                if i == j:
                    C[j, j] = sqrt(max(total, 1e-300))
                else:
                    C[i, j] = total / C[j, j]
        for i in range(n):  # row i of G = P_f F^T P_p^-1
            for j in range(n):
                total = 0.0
                for m in range(j, n):
                    total += P_f[k, i, m] * F[j, m]
                for m in range(j):
                    total -= C[j, m] * G[i, m]
                G[i, j] = total / C[j, j]
            for j in range(n - 1, -1, -1):
                total = G[i, j]
                for m in range(j + 1, n):
                    total -= C[m, j] * G[i, m]
                G[i, j] = total / C[j, j]
        for i in range(n):
            for j in range(n):
                D[i, j] = P_f[k + 1, i, j] - ahead[i, j]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += G[i, j] * (u_f[k + 1, j] - u_p[k + 1, j])
            u_f[k, i] += total
            for j in range(n):
                value = 0.0
                for m in range(n):
                    value += G[i, m] * D[m, j]
                Q[i, j] = value
        for i in range(n):
            for j in range(i, n):
                total = P_f[k, i, j]
                for m in range(n):
                    total += Q[i, m] * G[j, m]
                P_f[k, i, j] = total
                P_f[k, j, i] = total
