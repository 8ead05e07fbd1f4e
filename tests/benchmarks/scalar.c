/* The joint stiffness of many postures, one after the other: what a plain C program needs for it.
 *
 * A translation of cdsm's own kernels, in the same order of steps, for the same trees and routings.
 * cc -O3 -march=native -shared -fPIC
 */
#include <math.h>
#include <string.h>

typedef const double *In;
typedef const long *Index;

static void cross(In a, In b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(In a, In b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void place(long nv, Index parent, In turn, In translation, In local, long sites, Index row,
                  In point, In q, double *R, double *o, double *z, double *x)
{
    memset(R, 0, 9 * sizeof *R);
    R[0] = R[4] = R[8] = 1.0;
    memset(o, 0, 3 * sizeof *o);
    for (long i = 1; i <= nv; i++) {
        const double *B = R + 9 * parent[i], *T = turn + 27 * i;
        const double cosine = cos(q[i - 1]), sine = sin(q[i - 1]);
        double S[9];
        for (int k = 0; k < 9; k++)
            S[k] = T[k] + cosine * T[9 + k] + sine * T[18 + k];
        for (int r = 0; r < 3; r++) {
            o[3 * i + r] = o[3 * parent[i] + r] + dot(B + 3 * r, translation + 3 * i);
            z[3 * i + r] = dot(B + 3 * r, local + 3 * i);
            for (int c = 0; c < 3; c++)
                R[9 * i + 3 * r + c] =
                    B[3 * r] * S[c] + B[3 * r + 1] * S[3 + c] + B[3 * r + 2] * S[6 + c];
        }
    }
    for (long p = 0; p < sites; p++)
        for (int r = 0; r < 3; r++)
            x[3 * p + r] = o[3 * row[p] + r] + dot(R + 9 * row[p] + 3 * r, point + 3 * p);
}

static void measure(long nv, long segments, Index segment, Index joint, In o, In z, In x, In F,
                    double *bent, double *L, double *J, double *K)
{
    for (long s = 0; s < segments; s++) {
        const long *at = segment + 5 * s;
        const long c = at[0], first = at[3], turn = at[4], end = at[8];
        const double *a = x + 3 * at[1], *b = x + 3 * at[2];
        double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double length = sqrt(dot(u, u)), inverse = 1.0 / length;
        for (int r = 0; r < 3; r++)
            u[r] *= inverse;
        L[c] += length;
        for (long t = first; t < end; t++) {
            const long j = joint[t];
            const double side = t < turn ? -1.0 : 1.0, *site = t < turn ? a : b;
            double arm[3], d[3], uz[3];
            for (int r = 0; r < 3; r++)
                arm[r] = side * (site[r] - o[3 * j + r]);
            cross(z + 3 * j, arm, d);
            cross(u, z + 3 * j, uz);
            const double along = dot(u, d);
            J[c * nv + j - 1] += along;
            double *v = bent + 6 * (t - first);
            for (int r = 0; r < 3; r++) {
                v[r] = F[c] * (d[r] - along * u[r]) * inverse;
                v[3 + r] = v[r] + F[c] * uz[r];
            }
            for (long other = first; other <= t; other++) {
                const long i = joint[other], low = i < j ? i : j, high = i < j ? j : i;
                const int same = (other < turn) == (t < turn);
                K[(low - 1) * nv + high - 1] += dot(bent + 6 * (other - first) + 3 * same, d);
            }
        }
    }
}

static void weigh(long nv, Index parent, In mass, In centre, In g, In R, In o, In z, double *heavy,
                  double *K)
{
    for (long i = 0; i <= nv; i++) {
        heavy[10 * i] = mass[i];
        for (int r = 0; r < 3; r++)
            heavy[10 * i + 1 + r] =
                mass[i] * (o[3 * i + r] + dot(R + 9 * i + 3 * r, centre + 3 * i));
    }
    for (long i = nv; i > 0; i--) {
        double *own = heavy + 10 * i, arm[3];
        for (int r = 0; r < 4; r++)
            heavy[10 * parent[i] + r] += own[r];
        for (int r = 0; r < 3; r++)
            arm[r] = own[1 + r] - own[0] * o[3 * i + r];
        cross(z + 3 * i, arm, own + 4);
        cross(g, z + 3 * i, own + 7);
    }
    for (long j = nv; j > 0; j--)
        for (long i = j; i > 0; i = parent[i])
            K[(i - 1) * nv + j - 1] -= dot(heavy + 10 * i + 7, heavy + 10 * j + 4);
}

/* K_θ (b, nv, nv) of b rows; scratch is as long as all that one row needs. */
void joint_stiffness(long rows, long nv, long cables, long sites, long segments, Index parent,
                     In turn, In translation, In local, Index row, In point, Index segment,
                     Index joint, In fixed, In mass, In centre, In gravity, In tip, In rigidity,
                     In q, In F, In W, double *scratch, double *out)
{
    double *R = scratch, *o = R + 9 * (nv + 1), *z = o + 3 * (nv + 1), *x = z + 3 * (nv + 1);
    double *heavy = x + 3 * sites, *bent = heavy + 10 * (nv + 1), *L = bent + 6 * nv;
    double *J = L + cables, *JX = J + cables * nv;
    for (long b = 0; b < rows; b++) {
        double *K = out + b * nv * nv, end[3];
        const double *f = W + 6 * b, *m = f + 3;
        memset(K, 0, nv * nv * sizeof *K);
        memset(J, 0, cables * nv * sizeof *J);
        memcpy(L, fixed, cables * sizeof *L);
        place(nv, parent, turn, translation, local, sites, row, point, q + b * nv, R, o, z, x);
        measure(nv, segments, segment, joint, o, z, x, F + b * cables, bent, L, J, K);
        for (int r = 0; r < 3; r++)
            end[r] = o[3 * nv + r] + dot(R + 9 * nv + 3 * r, tip);
        for (long i = 1; i <= nv; i++) {
            double arm[3];
            for (int r = 0; r < 3; r++)
                arm[r] = end[r] - o[3 * i + r];
            cross(z + 3 * i, arm, JX + 3 * (i - 1));
        }
        weigh(nv, parent, mass, centre, gravity, R, o, z, heavy, K);
        for (long c = 0; c < cables; c++) {
            /* EA/l_0, the wire as long as L under F */
            const double k = (rigidity[c] + F[b * cables + c]) / L[c], *own = J + c * nv;
            long last = nv;
            while (last > 0 && own[last - 1] == 0.0)
                last--;
            for (long i = 0; i < last; i++)
                for (long j = i; j < last; j++)
                    K[i * nv + j] += k * own[i] * own[j];
        }
        for (long i = 0; i < nv; i++)
            for (long j = 0; j < i; j++)
                K[i * nv + j] = K[j * nv + i];
        for (long i = 0; i < nv; i++) {
            double g[3], h[3];
            cross(f, z + 3 * (i + 1), g);
            cross(m, z + 3 * (i + 1), h);
            K[i * nv + i] -= dot(g, JX + 3 * i);
            for (long j = i + 1; j < nv; j++) {
                const double force = dot(g, JX + 3 * j), moment = dot(h, z + 3 * (j + 1));
                K[i * nv + j] -= force;
                K[j * nv + i] -= force + moment;
            }
        }
    }
}
