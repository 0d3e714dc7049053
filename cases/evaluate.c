/* Kernels that the form compiler made (`forms/point.py`), called point by point. */

#include <stdint.h>
#include <string.h>

/* FFCx: A += values. Up to DOLFINx 0.9 kernels have no last argument, and a C function without it ignores it. */
typedef void (*kernel)(double *, const double *, const double *, const double *, const int *, const uint8_t *, void *);

#define MOST_INPUTS 1024

/* out[t, i] += f(inputs of set t, point i), inputs from blocks of `width` numbers, `jump` apart from set to set and
 * `stride` from point to point (0: the same for all); before that, the first `clear` numbers of out[t, i] are zeroed.
 * With an `out_jump` of 0 the results of all sets are added up. */
void evaluate(uintptr_t function, long sets, long n, int blocks, const uintptr_t *block, const long *width,
              const long *jump, const long *stride, double *out, long out_jump, long out_stride, long clear)
{
    kernel f = (kernel)function;
    double w[MOST_INPUTS];
    const double nowhere[6] = {0};
    for (long t = 0; t < sets && n > 0; ++t)
    {
        long at = 0;
        for (int b = 0; b < blocks; at += width[b++])
            memcpy(w + at, (const double *)block[b] + t * jump[b], sizeof(double) * width[b]);
        double *row = out + t * out_jump;
        for (long i = 0; i < n; ++i, row += out_stride)
        {
            at = 0;
            for (int b = 0; b < blocks; at += width[b++])
                if (stride[b] != 0)
                    for (long j = 0; j < width[b]; ++j)
                        w[at + j] = ((const double *)block[b])[t * jump[b] + i * stride[b] + j];
            if (t == 0 || out_jump != 0)
                for (long j = 0; j < clear; ++j)
                    row[j] = 0.0;
            f(row, w, NULL, nowhere, NULL, NULL, NULL);
        }
    }
}

/* The same with a kernel of `size` results that takes `batch` points at once, and computes what depends on parameters
 * alone once for all of them; `single` inputs are for the batch, not for each of its points. */
void evaluate_batches(uintptr_t function, long n, long batch, int blocks, const uintptr_t *block, const long *width,
              const long *stride, const long *single, long size, double *out, long out_stride, long clear)
{
    kernel f = (kernel)function;
    const double nowhere[6] = {0};
    long total = 0;
    for (int b = 0; b < blocks; ++b)
        total += width[b] * (single[b] ? 1 : batch);
    double w[total + 1], result[batch * size];
    for (long i = 0; i < n; i += batch, out += batch * out_stride)
    {
        const long here = n - i < batch ? n - i : batch;
        double *to = w;
        for (int b = 0; b < blocks; ++b)
        {
            const long points = single[b] ? 1 : batch;
            const double *from = (const double *)block[b] + (single[b] ? 0 : i * stride[b]);
            /* The last batch is filled up with its last point. */
            if (i == 0 || (stride[b] != 0 && !single[b]))
                for (long j = 0; j < points; ++j)
                    memcpy(to + j * width[b], from + (j < here ? j : here - 1) * (single[b] ? 0 : stride[b]),
                           sizeof(double) * width[b]);
            to += points * width[b];
        }
        memset(result, 0, sizeof result);
        f(result, w, NULL, nowhere, NULL, NULL, NULL);
        for (long j = 0; j < here; ++j)
        {
            double *row = out + j * out_stride;
            for (long k = 0; k < clear; ++k)
                row[k] = 0.0;
            for (long k = 0; k < size; ++k)
                row[k] += result[j * size + k];
        }
    }
}
