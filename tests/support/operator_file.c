#include "support/operator_file.h"

char operator_file_folder[64], operator_file_path[256];
static lam_error error;

void operator_file_setup(void) {
    sample_folder(operator_file_folder);
    snprintf(operator_file_path, sizeof operator_file_path, "%s/operator.h5", operator_file_folder);
    error = (lam_error){.message = ""};
}

void operator_file_teardown(void) {
    sample_folder_remove(operator_file_folder);
}

void operator_file_judge(const char *what, lam_status expected, const char *word) {
    lam_operator *op = NULL;
    error = (lam_error){.message = ""};
    const lam_status status = lam_operator_open(operator_file_path, &op, &error);
    ck_assert_msg(status == expected, "%s: %s (%s)", what, lam_status_text(status), error.message);
    ck_assert((op != NULL) == (status == LAM_OK));
    if (status != LAM_OK) {
        ck_assert_msg(strstr(error.message, word) != NULL, "%s: no '%s' in: %s", what, word, error.message);
        ck_assert_msg(strstr(error.message, operator_file_path) != NULL, "%s: no file in: %s", what,
                      error.message);
    }
    lam_operator_close(op);
}

static size_t or_else(size_t value, size_t usual) {
    return value > 0 ? value : usual;
}

static void write_array(store *s, const file_recipe *r, const char *name, int rank, const size_t *dims,
                        float value) {
    size_t count = 1;
    for (int i = 0; i < rank; i++) count *= dims[i];
    if (r->without != NULL && strcmp(r->without, name) == 0) return;
    if (r->scales != NULL && strstr(r->scales, name) != NULL) {
        char scale_name[64];
        const size_t size = or_else(r->scale_size, 2);
        float *scale = test_allocate(size, sizeof *scale);
        for (size_t j = 0; j < size; j++) scale[j] = r->scale;
        snprintf(scale_name, sizeof scale_name, "%s_scale", name);
        ck_ok(store_write(s, scale_name, STORE_F32, 1, &size, scale, &error));
        free(scale);
    }
    if (r->narrow != NULL && strstr(r->narrow, name) != NULL) {
        uint32_t *values = test_allocate(count, sizeof *values);
        for (size_t i = 0; i < count; i++)
            memcpy((char *)values + i * store_type_size(r->narrow_type), &r->fill,
                   store_type_size(r->narrow_type) < 2 ? 1 : 2);
        ck_ok(store_write(s, name, r->narrow_type, rank, dims, values, &error));
        free(values);
        return;
    }
    if (r->other_type != NULL && strcmp(r->other_type, name) == 0) {
        double *doubles = test_allocate(count, sizeof *doubles);
        ck_ok(store_write(s, name, STORE_F64, rank, dims, doubles, &error));
        free(doubles);
        return;
    }
    float *x = test_allocate(count, sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = value;
    if (r->bad != NULL && strcmp(r->bad, name) == 0) x[r->bad_index] = r->bad_value;
    ck_ok(store_write(s, name, STORE_F32, rank, dims, x, &error));
    free(x);
}

static void write_attribute(store *s, const char *name, const char *given, const char *usual) {
    if (given == NULL) given = usual;
    if (strcmp(given, "-") != 0) ck_ok(store_set_text(s, "/operator", name, given, &error));
}

void operator_file_write(const file_recipe *r) {
    store *s = NULL;
    const char *kind = r->kind != NULL ? r->kind : "low_rank", *form = r->form != NULL ? r->form : "folded";
    bool factored = strcmp(form, "factored") == 0;
    size_t n = or_else(r->n, 6), C = or_else(r->n_channels, factored ? 2 : 1);
    size_t left[2] = {or_else(r->left[0], n), or_else(r->left[1], 2)};
    size_t V[2] = {or_else(r->V[0], n), or_else(r->V[1], 2)};
    size_t core[3] = {or_else(r->core[0], C), or_else(r->core[1], 2), or_else(r->core[2], 2)};
    size_t M[3] = {or_else(r->M[0], C), or_else(r->M[1], n), or_else(r->M[2], n)}, rho[2] = {C, n};
    ck_ok(store_create(operator_file_path, &s, &error));
    write_array(s, r, "/mesh/reflectance", 2, rho, 0.5f);
    if (r->without == NULL || strcmp(r->without, "/operator") != 0) {
        write_attribute(s, "kind", kind, NULL);
        write_attribute(s, "layout", r->layout, "rows");
        if (r->precision != NULL) write_attribute(s, "precision", r->precision, NULL);
        if (strcmp(kind, "exact") != 0) write_attribute(s, "form", form, NULL);
        if (strcmp(kind, "exact") == 0) {
            write_array(s, r, "/operator/M", 3, M, 0.1f);
        } else {
            write_array(s, r, factored ? "/operator/U" : "/operator/Y", 2, left, -0.1f);
            write_array(s, r, "/operator/V", 2, V, 0.1f);
            if (factored) write_array(s, r, "/operator/core", 3, core, 0.1f);
        }
        if (r->order_size > 0)
            ck_ok(store_write(s, "/operator/order", STORE_U32, 1, &r->order_size, r->order, &error));
    }
    ck_ok(store_seal(s, &error));
}
