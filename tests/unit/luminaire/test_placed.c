/* Lists of luminaires: frames against formulas, rows and grids, factors, and what is refused. */
#include "solver/base/photometry.h"
#include "solver/base/vector3.h"
#include "solver/luminaire/placed.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static const placed_options metres = {.unit = 0};

static placed_luminaires must_read(const char *name, const char *text, const placed_options *options) {
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    ck_ok(placed_read_text(name, text, strlen(text), options, &p, &error));
    return p;
}

/* A list of one luminaire with these members beside its name and file. */
static placed_luminaires read_one(const char *members) {
    char text[1024];
    snprintf(text, sizeof text, "{\"luminaires\": [{\"name\": \"a\", \"file\": \"f.ies\", %s}]}", members);
    placed_luminaires p = must_read("l.json", text, &metres);
    ck_assert_uint_eq(p.n, 1);
    return p;
}

static void near3(const double *got, double x, double y, double z) {
    ck_assert_msg(fabs(got[0] - x) < 1e-12 && fabs(got[1] - y) < 1e-12 && fabs(got[2] - z) < 1e-12,
                  "%.15g %.15g %.15g, not %.15g %.15g %.15g", got[0], got[1], got[2], x, y, z);
}

static void check_orthonormal(const placed_luminaire *l) {
    double y[3];
    cross3(l->z, l->x, y);
    near3(l->y, y[0], y[1], y[2]);
    ck_assert(fabs(dot3(l->x, l->x) - 1) < 1e-14 && fabs(dot3(l->z, l->z) - 1) < 1e-14 &&
              fabs(dot3(l->x, l->z)) < 1e-14);
}

#define H 0.70710678118654752440 /* the square root of one half */

/* Members, and the x and z that they give. */
static const struct {
    const char *members;
    double x[3], z[3];
} frames[] = {
    {"\"at\": [0, 0, 3]", {1, 0, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"aim\": [0, 0, -7]", {1, 0, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"aim\": [0, 0, 2]", {1, 0, 0}, {0, 0, -1}},
    /* Tilted by 45 degrees to x and to y; C0 goes with it. */
    {"\"at\": [0, 0, 3], \"aim\": [1, 0, -1]", {H, 0, H}, {-H, 0, H}},
    {"\"at\": [0, 0, 3], \"aim\": [0, 2, -2]", {1, 0, 0}, {0, -H, H}},
    {"\"at\": [0, 0, 3], \"aim_at\": [3, 0, 0]", {H, 0, H}, {-H, 0, H}},
    {"\"at\": [1, 1, 3], \"aim_at\": [1, 4, 0]", {1, 0, 0}, {0, -H, H}},
    /* Along x C0 is where tilting takes it, up and down. */
    {"\"at\": [0, 0, 3], \"aim\": [1, 0, 0]", {0, 0, 1}, {-1, 0, 0}},
    {"\"at\": [0, 0, 3], \"aim\": [-1e-200, 0, 0]", {0, 0, -1}, {1, 0, 0}},
    {"\"at\": [0, 0, 3], \"aim\": [1, 1e-9, 0]", {0, 0, 1}, {-1, -1e-9, 0}},
    /* c0 as a direction, of which the part across the aim counts, and as degrees. */
    {"\"at\": [0, 0, 3], \"c0\": [0, 5, 0]", {0, 1, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"c0\": [1, 1, 9]", {H, H, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"c0\": 90", {0, 1, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"c0\": -315", {H, H, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"aim\": [1, 0, -1], \"c0\": [0, 1, 0]", {0, 1, 0}, {-H, 0, H}},
    {"\"at\": [0, 0, 3], \"aim\": [1, 0, -1], \"c0\": 90", {0, 1, 0}, {-H, 0, H}},
    /* Turns as positions have them: about x by 45 degrees, about z, and about a diagonal by a third. */
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [2, 0, 0], \"degrees\": 45}", {1, 0, 0}, {0, -H, H}},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [0, 0, 1], \"degrees\": 90}", {0, 1, 0}, {0, 0, 1}},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [1, 1, 1], \"degrees\": 120}", {0, 1, 0}, {1, 0, 0}},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [0, 1, 0], \"degrees\": -405}", {H, 0, H}, {-H, 0, H}}};

START_TEST(frames_are_those_of_formulas) {
    placed_luminaires p = read_one(frames[_i].members);
    const double *x = frames[_i].x, *z = frames[_i].z;
    near3(p.luminaires->x, x[0], x[1], x[2]);
    near3(p.luminaires->z, z[0], z[1], z[2]);
    check_orthonormal(p.luminaires);
    placed_free(&p);
}
END_TEST

START_TEST(any_frame_is_orthonormal) {
    uint32_t state = 53;
    for (int k = 0; k < 300; k++) {
        char members[256];
        double v[6];
        for (int d = 0; d < 6; d++) {
            state = state * 1664525 + 1013904223;
            v[d] = (double)state / 2147483648. - 1;
        }
        snprintf(members, sizeof members,
                 "\"at\": [0, 0, 0], \"aim\": [%.17g, %.17g, %.17g], \"c0\": [%g, %g, %g]", v[0], v[1], v[2],
                 v[3], v[4], v[5]);
        placed_luminaires p = read_one(members);
        const placed_luminaire *l = p.luminaires;
        check_orthonormal(l);
        ck_assert_double_eq_tol(-dot3(l->z, v), sqrt(dot3(v, v)), 1e-12);
        ck_assert(dot3(l->x, v + 3) > 0); /* the nearest to c0 that is across the aim */
        ck_assert_double_eq_tol(dot3(l->y, v + 3), 0, 1e-5);
        placed_free(&p);
    }
}
END_TEST

START_TEST(rows_and_grids) {
    placed_luminaires p =
        must_read("l.json",
                  "\xef\xbb\xbf{\"unit\": \"ft\", \"luminaires\": [{\"name\": \"g\", \"file\": \"f.ies\", "
                  "\"from\": [1, 2, 10],"
                  "\"steps\": [[3, 0, 0], [0, 4, 1]], \"counts\": [2, 3], \"aim_at\": [1, 2, 0]},"
                  "{\"name\": \"r\", \"group\": \"all\", \"file\": \"f.ies\", \"from\": [0, 0, 0], "
                  "\"steps\": [[0, 0, 1]],"
                  "\"counts\": [1]}]}",
                  &metres);
    ck_assert(p.n == 7 && p.n_files == 1);
    for (size_t k = 0; k < 6; k++) {
        const placed_luminaire *l = &p.luminaires[k];
        const double i = (double)(k / 3), j = (double)(k % 3), ft = .3048;
        char name[16];
        snprintf(name, sizeof name, "g.%zu.%zu", k / 3, k % 3);
        ck_assert_str_eq(l->name, name);
        ck_assert_str_eq(l->group, "g"); /* a row is a group, unless it has one */
        near3(l->at, (1 + 3 * i) * ft, (2 + 4 * j) * ft, (10 + j) * ft);
        const double down[3] = {-3 * i, -4 * j, -10 - j}, length = sqrt(dot3(down, down));
        near3(l->z, -down[0] / length, -down[1] / length, -down[2] / length);
        ck_assert_uint_eq(l->entry, 0);
    }
    ck_assert_str_eq(p.luminaires[6].name, "r.0");
    ck_assert_str_eq(p.luminaires[6].group, "all");
    placed_free(&p);
    /* Coordinates are in the unit of the caller where the list states none. */
    p = must_read("l.json", "{\"luminaires\": [{\"name\": \"a\", \"file\": \"f\", \"at\": [1, 2, 3]}]}",
                  &(placed_options){.unit = .001});
    near3(p.luminaires->at, .001, .002, .003);
    placed_free(&p);
}
END_TEST

START_TEST(factors) {
    placed_luminaires p = read_one("\"at\": [0, 0, 0], \"dim\": 0.5, \"maintenance\": 0.8, \"flux\": 3600, "
                                   "\"opening\": \"point\", \"ignore\": [\"housing\", \"lid\"]");
    const placed_luminaire *l = p.luminaires;
    ck_assert(l->dim == .5 && l->maintenance == .8 && l->flux == 3600 && l->is_point);
    ck_assert_double_eq_tol(l->scale, .4, 1e-15);
    ck_assert(l->n_ignored == 2 && strcmp(p.ignored[l->ignored + 1].text, "lid") == 0);
    near3(l->colour, 1, 1, 1);
    placed_free(&p);
    p = read_one("\"at\": [0, 0, 0], \"colour\": [2, 1, 0], \"dim\": 0");
    const double luminance = 2 * LUMINANCE_RED + LUMINANCE_GREEN;
    near3(p.luminaires->colour, 2 / luminance, 1 / luminance, 0);
    ck_assert(isnan(p.luminaires->flux) && p.luminaires->scale == 0 && !p.luminaires->is_point);
    placed_free(&p);
}
END_TEST

/* x and y of the locus of black bodies (CIE 15, 2 degrees). */
static const double locus[][3] = {{2000, .5267, .4133}, {2856, .4476, .4074}, {4000, .3805, .3768},
                                  {5000, .3451, .3516}, {6500, .3135, .3237}, {10000, .2807, .2884}};

START_TEST(colours_of_black_bodies) {
    static const double of_rgb[3][3] = {
        {.4124564, .3575761, .1804375}, {.2126729, .7151522, .0721750}, {.0193339, .1191920, .9503041}};
    char members[64];
    snprintf(members, sizeof members, "\"at\": [0, 0, 0], \"cct\": %g", locus[_i][0]);
    placed_luminaires p = read_one(members);
    const double *c = p.luminaires->colour;
    double xyz[3];
    for (int k = 0; k < 3; k++) xyz[k] = dot3(of_rgb[k], c);
    const double sum = xyz[0] + xyz[1] + xyz[2];
    ck_assert_double_eq_tol(luminance_of(c[0], c[1], c[2]), 1, 1e-12);
    ck_assert_double_eq_tol(xyz[0] / sum, locus[_i][1], 1e-3);
    ck_assert_double_eq_tol(xyz[1] / sum, locus[_i][2], 1e-3);
    placed_free(&p);
}
END_TEST

START_TEST(csv_says_the_same) {
    static const char *const csvs[] = {
        "name,file,x,y,z,aim_x,aim_y,aim_z,c0_degrees,dim,group,ignore,lamp_set\r\n"
        "a,\"f,\"\"1\"\".ies\",1,2,3,1,0,-1,90,.5,g,housing | lid,2\r\n\r\nb,f.ies, 4 ,5,6,,,,,,,\r\n,,,\r\n",
        "Name;FILE;x;y;z;aim_x;aim_y;aim_z;c0_degrees;dim;group;ignore;lamp_set\n"
        "a;\"f,\"\"1\"\".ies\";1,0;2;3;1;0;-1;90;0,5;g;housing|lid;2\n\nb;f.ies;4;5;6\n",
        "x\ty\tz\tname\tfile\taim_x\taim_y\taim_z\tc0_degrees\tdim\tgroup\tignore\tlamp_set\n"
        "1\t2\t3\ta\t\"f,\"\"1\"\".ies\"\t1\t0\t-1\t90\t0.5\tg\thousing|lid\t2\n\n4\t5\t6\tb\tf.ies\n"};
    placed_luminaires p = must_read("l.txt", csvs[_i], &metres);
    ck_assert(p.is_csv && p.n == 2 && p.n_files == 2);
    const placed_luminaire *a = p.luminaires, *b = a + 1;
    near3(a->at, 1, 2, 3);
    near3(a->x, 0, 1, 0);
    near3(a->z, -H, 0, H);
    ck_assert(a->scale == .5 && a->n_ignored == 2 && p.files[0].set == 2 && p.files[1].set == 0);
    ck_assert_str_eq(p.ignored[0].text, "housing");
    ck_assert_str_eq(p.ignored[1].text, "lid");
    ck_assert_str_eq(p.files[0].name, "f,\"1\".ies");
    ck_assert_str_eq(a->group, "g");
    ck_assert_str_eq(b->name, "b");
    near3(b->at, 4, 5, 6);
    near3(b->x, 1, 0, 0);
    ck_assert(a->entry == 2 && b->entry == 4 && b->group[0] == '\0' && b->n_ignored == 0);
    placed_free(&p);
}
END_TEST

START_TEST(csv_of_all_columns) {
    placed_luminaires p =
        must_read("l.csv",
                  "name,file,opening,x,y,z,aim_at_x,aim_at_y,aim_at_z,turn_x,turn_y,turn_z,turn_degrees,c0_x,"
                  "c0_y,c0_z,red,"
                  "green,blue,maintenance,flux,cct\n"
                  "a,f,point,0,0,3,3,0,0,,,,,0,1,0,1,1,1,0.8,100,\nb,f,file,0,0,3,,,,1,0,0,45,,,,,,,,,4000\n",
                  &metres);
    near3(p.luminaires[0].x, 0, 1, 0);
    near3(p.luminaires[0].z, -H, 0, H);
    near3(p.luminaires[1].z, 0, -H, H);
    ck_assert(p.luminaires[0].is_point && p.luminaires[0].flux == 100 && p.luminaires[0].maintenance == .8);
    ck_assert(!p.luminaires[1].is_point && p.luminaires[1].colour[0] > p.luminaires[1].colour[2]);
    placed_free(&p);
}
END_TEST

/* Members of a luminaire, and what is said of them. */
static const struct {
    const char *members, *wanted;
} faults[] = {
    {"\"at\": [0, 0, 0], \"dimm\": 1", " has a member \"dimm\", which is not known: did you mean dim?"},
    {"\"dim\": 1", " must have at, the place of one, or from, the first of a row"},
    {"\"at\": [0, 0, 0], \"from\": [0, 0, 0]", " must have at, the place of one, or from"},
    {"\"at\": [0, 0]", ": at = [0,0], must be an array of three numbers"},
    {"\"at\": [0, 0, \"x\"]", ": at = \"x\", must be a number"},
    {"\"at\": [0, 0, 2e9]", ": at = 2000000000.0, must be at most 1000000000"},
    {"\"at\": [0, 0, 0], \"dim\": -0.5", ": dim = -0.5, must not be negative"},
    {"\"at\": [0, 0, 0], \"dim\": 1001", ": dim = 1001, must be at most 1000"},
    {"\"at\": [0, 0, 0], \"dim\": true", ": dim = true, must be a number"},
    {"\"at\": [0, 0, 0], \"maintenance\": 0", ": maintenance = 0, must be above 0"},
    {"\"at\": [0, 0, 0], \"maintenance\": 80", ": maintenance = 80, must be at most 1"},
    {"\"at\": [0, 0, 0], \"flux\": 0", ": flux = 0, must be above 0"},
    {"\"at\": [0, 0, 0], \"cct\": 40", ": cct = 40, must be at least 1667"},
    {"\"at\": [0, 0, 0], \"cct\": 40000", ": cct = 40000, must be at most 25000"},
    {"\"at\": [0, 0, 0], \"cct\": 4000, \"colour\": [1, 1, 1]",
     " has cct and colour; it must have one of them"},
    {"\"at\": [0, 0, 0], \"colour\": [1, -1, 1]", ": colour = [1,-1,1], must have no number below 0"},
    {"\"at\": [0, 0, 0], \"colour\": [0, 0, 0]",
     ": colour = [0,0,0], must have no number below 0, and one above"},
    {"\"at\": [0, 0, 0], \"lamp_set\": 1.5", ": lamp_set = 1.5, must be a whole number"},
    {"\"at\": [0, 0, 0], \"lamp_set\": 0", ": lamp_set = 0, must be at least 1"},
    {"\"at\": [0, 0, 0], \"opening\": \"disc\"", ": opening = \"disc\", must be \"file\" or \"point\""},
    {"\"at\": [0, 0, 0], \"ignore\": \"x\"", ": ignore = \"x\", must be an array of names of groups"},
    {"\"at\": [0, 0, 0], \"ignore\": [1]", ": a name of ignore = 1, must be a text"},
    {"\"at\": [0, 0, 0], \"aim\": [0, 0, 0]", ": aim = [0,0,0], must have a length above 0"},
    {"\"at\": [0, 0, 0], \"aim\": [0, 0, -1], \"aim_at\": [0, 0, -1]",
     " must have one of aim, aim_at and turn, not several"},
    {"\"at\": [0, 0, 3], \"aim_at\": [0, 0, 3]", ": aim_at = [0,0,3], must be another place than its own"},
    {"\"at\": [0, 0, 3], \"c0\": [0, 0, 1]", ": c0 = [0,0,1], must not lie along the aim"},
    {"\"at\": [0, 0, 3], \"aim\": [1, 1, 0], \"c0\": [-3, -3, 1e-9]", "must not lie along the aim"},
    {"\"at\": [0, 0, 3], \"c0\": [0, 0, 0]", ": c0 = [0,0,0], must have a length above 0"},
    {"\"at\": [0, 0, 3], \"c0\": \"x\"",
     ": c0 = \"x\", must be a direction [x, y, z] or a number of degrees"},
    {"\"at\": [0, 0, 3], \"turn\": 45", ": turn = 45, must be an object"},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [0, 0, 1], \"degree\": 45}",
     ": turn has a member \"degree\", which is not known: did you mean degrees?"},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [0, 0, 0], \"degrees\": 45}",
     ": axis of turn = [0,0,0], must have"},
    {"\"at\": [0, 0, 3], \"turn\": {\"axis\": [0, 0, 1], \"degrees\": 45}, \"c0\": 5",
     " has turn, which turns C0"},
    {"\"at\": [0, 0, 3], \"counts\": [3]", " has at; steps and counts are for a row, which has from"},
    {"\"from\": [0, 0, 3], \"counts\": [3]", " has from; then it must have steps and counts too"},
    {"\"from\": [0, 0, 3], \"counts\": [3], \"steps\": []", ": steps = [], must be an array of 1 to 3 steps"},
    {"\"from\": [0, 0, 3], \"counts\": [3, 1], \"steps\": [[1, 0, 0]]",
     ": counts = [3,1], must be an array of"},
    {"\"from\": [0, 0, 3], \"counts\": [0], \"steps\": [[1, 0, 0]]", ": a count = 0, must be at least 1"},
    {"\"from\": [0, 0, 3], \"counts\": [2.5], \"steps\": [[1, 0, 0]]",
     ": counts = [2.5], must be whole numbers"},
    {"\"from\": [0, 0, 3], \"counts\": [2], \"steps\": [[0, 0, 0]]",
     "must have a length above 0 where there is"},
    {"\"from\": [0, 0, 3], \"counts\": [1000, 1000], \"steps\": [[1, 0, 0], [0, 1, 0]]",
     ": counts make 1000000 luminaires, must be at most 65536"},
    {"\"at\": [0, 0, 0], \"group\": \"\"", ": group = \"\", must have 1 to 63 bytes"},
    {"\"at\": [0, 0, 0], \"group\": \"a=1\"", ": group = \"a=1\", must have no control character"},
    {"\"at\": [0, 0, 0], \"group\": \"\\u001b\"", ": group = \"\\u001B\", must have no control character"},
    {"\"at\": [0, 0, 0], \"group\": \"a\"", ": group = a, which is the name of luminaires[0]"},
    {"\"at\": [0, 0, 0], \"dim\": 1, \"dim\": 1", ": line 1, column 79: duplicate object key"},
};

static void refused(const char *name, const char *text, const char *wanted) {
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    const lam_status status = placed_read_text(name, text, strlen(text), &metres, &p, &error);
    ck_assert(status == LAM_ERR_ARGUMENT || status == LAM_ERR_FORMAT);
    ck_assert_msg(strncmp(error.message, name, strlen(name)) == 0 && strstr(error.message, wanted) != NULL,
                  "'%s' does not say '%s'", error.message, wanted);
    ck_assert(p.luminaires == NULL && p.files == NULL && p.n == 0);
}

START_TEST(each_fault_has_one_line) {
    char text[512], wanted[256];
    snprintf(text, sizeof text, "{\"luminaires\": [{\"name\": \"a\", \"file\": \"f.ies\", %s}]}",
             faults[_i].members);
    snprintf(wanted, sizeof wanted, "%s", faults[_i].wanted);
    refused("l.json", text, wanted);
    if (strstr(wanted, "line 1") != NULL) return;
    /* The same behind another, at its own place. */
    snprintf(text, sizeof text,
             "{\"luminaires\": [{\"name\": \"b\", \"file\": \"f\", \"at\": [0, 0, 0]},"
             "{\"name\": \"a\", \"file\": \"f.ies\", %s}]}",
             faults[_i].members);
    refused("l.json", text, "l.json: luminaires[1]");
}
END_TEST

/* Lists that are wrong, and what is said of them. */
static const struct {
    const char *text, *wanted;
} lists[] = {
    {"", ": the file is empty"},
    {"{", ": line 1, column 1: string or '}' expected"},
    {"[{}]", ": the file = [{}], must be an object"},
    {"{}", ": luminaires = nothing, must be an array of 1 to 65536 luminaires"},
    {"{\"luminaires\": []}", ": luminaires = [], must be an array of 1 to 65536 luminaires"},
    {"{\"luminaires\": [7]}", ": luminaires[0] = 7, must be an object"},
    {"{\"luminaire\": []}",
     ": the file has a member \"luminaire\", which is not known: did you mean luminaires?"},
    {"{\"luminaires\": [{}]}", ": luminaires[0] has no name: it must have one"},
    {"{\"luminaires\": [{\"name\": \"a\", \"at\": [0, 0, 0]}]}",
     ": luminaires[0] has no file: it must name one"},
    {"{\"luminaires\": [{\"name\": \"a\", \"at\": [0, 0, 0], \"file\": \"\"}]}",
     ": file = \"\", must have 1 to"},
    {"{\"unit\": \"km\", \"luminaires\": []}", ": unit = \"km\", must be one of mm|cm|m|in|ft"},
    {"{\"files\": [], \"luminaires\": []}", ": files = [], must be an object of words and paths"},
    {"{\"files\": {\"x\": 1}, \"luminaires\": []}", ": files.x = 1, must be a path"},
    {"{\"luminaires\": [{\"name\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0]},"
     "{\"name\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0]}]}",
     ": luminaires[1]: name = a, which luminaires[0] has too"},
    {"{\"luminaires\": [{\"name\": \"a.1\", \"file\": \"f\", \"at\": [0, 0, 0]}, {\"name\": \"a\", \"file\": "
     "\"f\","
     "\"from\": [0, 0, 0], \"steps\": [[1, 0, 0]], \"counts\": [2]}]}",
     ": luminaires[1]: name = a.1, which luminaires[0] has too"},
    {"{\"luminaires\": [{\"name\": \"b\", \"group\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0]},"
     "{\"name\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0]}]}",
     ": luminaires[0]: group = a, which is the name of luminaires[1]"},
    {"{\"luminaires\": [{\"name\": \"0123456789012345678901234567890123456789012345678901234567890\", "
     "\"file\": \"f\","
     "\"from\": [0, 0, 0], \"steps\": [[1, 0, 0]], \"counts\": [11]}]}",
     " has 64 bytes, must have at most 63"},
    {"{\"luminaires\": [{\"name\": \"a\", \"file\": \"f\", \"at\": [0, 0, 0]},{\"name\": \"b\", \"file\": "
     "\"f\","
     "\"from\": [0, 0, 0], \"steps\": [[1, 0, 0]], \"counts\": [65536]}]}",
     ": luminaires[1]: with it there are 65537 luminaires, must be at most 65536"},
    {"name,file,x,y,z\n", ": has no luminaire, must have 1 to 65536"},
    {"name,file,x,y\na,f,1,2\n", ": line 1 has no column z: name, file, x, y and z must be there"},
    {"name,file,x,y,z,dimm\n", ": line 1: column 6, \"dimm\", is not known: did you mean dim?"},
    {"name,file,x,y,z,x\n", ": line 1 has the column x twice"},
    {"\n\nname,file,x,y,z\na,f,1,2,3\nb,f,1,two,3\n", ": line 5: y = two, must be a number"},
    {"name,file,x,y,z\na,f,1,2,\n", ": line 2: at = null, must be a number"},
    {"name,file,x,y,z\na,f,1,2,3,4\n", ": line 2 has 6 cells, its first line names 5 columns"},
    {"name,file,x,y,z\na,f,1,\"2,3\n", ": line 2: cell 4 has a quote without its other one"},
    {"name,file,x,y,z\na,f,1,\"2\"2,3\n", ": line 2: cell 4 has a quote without its other one"},
    {"name,file,x,y,z,dim\na,f,1,2,3,-1\n", ": line 2: dim = -1.0, must not be negative"},
    {"name,file,x,y,z\na,f,1,2,3\n\na,f,1,2,3\n", ": line 4: name = a, which line 2 has too"},
    {"name,file,x,y,z,c0_degrees,c0_x,c0_y,c0_z\na,f,1,2,3,9,1,0,0\n", ": line 2 has c0_degrees beside c0_x"},
    {"name,file,x,y,z,c0_x,c0_y,c0_z,c0_degrees\na,f,1,2,3,1,0,0,9\n", ": line 2 has c0_degrees beside c0_x"},
    {"name,file,x,y,z,turn_degrees\na,f,1,2,3,9\n", ": line 2: axis of turn = nothing, must be an array"},
    {"name,file,x,y,z,ignore\na,f,1,2,3,a||b\n",
     ": line 2: a name of ignore = \"\", must have 1 to 255 bytes"},
};

START_TEST(each_list_that_is_wrong_has_one_line) {
    refused(lists[_i].text[0] == '{' || lists[_i].text[0] == '[' ? "l.json" : "l.csv", lists[_i].text,
            lists[_i].wanted);
}
END_TEST

/* Sizes have limits that are checked first. */
START_TEST(large_lists) {
    lam_error error = {0};
    placed_luminaires p = {.n = 0};
    ck_assert_int_eq(placed_read_text("l.json", "", PLACED_BYTES_MOST + 1, &metres, &p, &error),
                     LAM_ERR_FORMAT);
    ck_assert(strstr(error.message, "has 8388609 bytes, more than the 8 MiB") != NULL);
    char *text = malloc(1 << 20);
    size_t length = (size_t)sprintf(text, "name,file,x,y,z\n");
    for (int k = 0; k <= PLACED_FILES_MOST; k++)
        length += (size_t)sprintf(text + length, "n%d,f%d,1,2,3\n", k, k);
    ck_assert_int_eq(placed_read_text("l.csv", text, length, &metres, &p, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message, "l.csv: line 1002: the list names more than 1000 files");
    length = (size_t)sprintf(text, "name,file,x,y,z");
    for (int k = 0; k < 60; k++) text[length++] = ',';
    ck_assert_int_eq(placed_read_text("l.csv", text, length, &metres, &p, &error), LAM_ERR_FORMAT);
    ck_assert(strstr(error.message, "line 1 has more than 64 cells") != NULL);
    free(text);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("placed");
    TCase *tests = tcase_create("all");
    tcase_add_loop_test(tests, frames_are_those_of_formulas, 0, sizeof frames / sizeof *frames);
    tcase_add_test(tests, any_frame_is_orthonormal);
    tcase_add_test(tests, rows_and_grids);
    tcase_add_test(tests, factors);
    tcase_add_loop_test(tests, colours_of_black_bodies, 0, sizeof locus / sizeof *locus);
    tcase_add_loop_test(tests, csv_says_the_same, 0, 3);
    tcase_add_test(tests, csv_of_all_columns);
    tcase_add_loop_test(tests, each_fault_has_one_line, 0, sizeof faults / sizeof *faults);
    tcase_add_loop_test(tests, each_list_that_is_wrong_has_one_line, 0, sizeof lists / sizeof *lists);
    tcase_add_test(tests, large_lists);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
