#include "solver/formfactor/closing.h"

#include "solver/formfactor/leaving.h"
#include "solver/formfactor/repair.h"

#include <stdlib.h>

lam_status closing_repair(form_factors *f, const mesh *m, const visibility *v, lam_error *error) {
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    leaving_measure(f, m, v);
    for (size_t i = 0; i < m->n; i++) outside[i] = leaving_outside(f, m, i);
    const lam_status status = repair_close(&f->upper, m->area, outside, f, error);
    free(outside);
    return status;
}

lam_status closing_merge(form_factors *f, const mesh *m, const visibility *v, packed_rows *rows, size_t rays,
                         const large_place *place, lam_error *error) {
    lam_status status = LAM_OK;
    f->rows_kept = rows->kept;
    TRY(upper_merge(rows, rays, m->area, place, &f->upper, error));
    packed_rows_free(rows);
    TRY(closing_repair(f, m, v, error));
done:
    return status;
}
