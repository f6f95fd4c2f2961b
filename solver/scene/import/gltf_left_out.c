/* Parts of a glTF that are not read, for people: maps, extensions with the faces that they are about.
 * Runs in the child. */
#include "solver/scene/import/gltf_amount.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Extensions that are read, or have a line of their own where they matter. */
static bool is_read(const char *extension) {
    static const char *const names[] = {"KHR_texture_transform",
                                        "KHR_materials_emissive_strength",
                                        "KHR_materials_transmission",
                                        "KHR_materials_pbrSpecularGlossiness",
                                        "KHR_draco_mesh_compression",
                                        "KHR_mesh_quantization",
                                        "KHR_lights_punctual",
                                        "KHR_texture_basisu",
                                        "EXT_texture_webp",
                                        GLTF_INSTANCES,
                                        GLTF_MESHOPT};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(extension, names[i]) == 0) return true;
    return strncmp(extension, "KHR_xmp", 7) == 0;
}

enum { EXTENSIONS_MOST = 16 };

/* Extensions that are left out, with the faces that each is about. */
typedef struct left_out {
    size_t n, more; /* those named, and others */
    const char *name[EXTENSIONS_MOST];
    gltf_amount with[EXTENSIONS_MOST];
    gltf_amount read, unread; /* of the scene that is read; of other nodes */
} left_out;

static void find_extensions(const gltf_file *g, left_out *out) {
    size_t i;
    json_t *name;
    json_array_foreach(json_object_get(g->root, "extensionsUsed"), i, name) {
        const char *extension = json_string_value(name);
        if (extension == NULL || is_read(extension)) continue;
        if (out->n < EXTENSIONS_MOST)
            out->name[out->n++] = extension;
        else
            out->more++;
    }
}

/* True where an extension is about the faces of a primitive: by its node, mesh or material. */
static bool is_about(const gltf_file *g, const char *extension, const json_t *node, const json_t *of,
                     const json_t *primitive) {
    const json_t *material = gltf_entry(g, "materials", json_object_get(primitive, "material"));
    return gltf_extension(node, extension) != NULL || gltf_extension(of, extension) != NULL ||
           gltf_extension(primitive, extension) != NULL || gltf_extension(material, extension) != NULL;
}

/* Adds the faces of all nodes. An instance has the extensions of its node, which is its parent. */
static void add_faces(gltf_file *g, const gltf_nodes *nodes, left_out *out) {
    const json_t *list = json_object_get(g->root, "nodes"), *primitive;
    for (size_t k = 0; k < nodes->n; k++) {
        const size_t at = nodes->order[k];
        const json_t *node = json_array_get(list, at);
        const json_t *of = gltf_entry(g, "meshes", json_object_get(node, "mesh"));
        const json_t *owner = at < g->own_nodes ? node : json_array_get(list, nodes->parent[at]);
        size_t p;
        json_array_foreach(json_object_get(of, "primitives"), p, primitive) {
            const gltf_amount amount = gltf_amount_of(g, primitive, &nodes->placed[at]);
            gltf_amount_add(k < nodes->n_read ? &out->read : &out->unread, &amount);
            for (size_t e = 0; k < nodes->n_read && e < out->n; e++)
                if (is_about(g, out->name[e], owner, of, primitive)) gltf_amount_add(&out->with[e], &amount);
        }
    }
}

static void tell_extensions(const gltf_file *g, const left_out *found) {
    char list[EXTENSIONS_MOST * 256] = "", amount[GLTF_AMOUNT_TEXT];
    size_t written = 0;
    for (size_t e = 0; e < found->n; e++) {
        written += (size_t)snprintf(list + written, sizeof list - written, "%s%.60s", e > 0 ? ", " : "",
                                    found->name[e]);
        if (!(found->with[e].faces > 0)) continue;
        gltf_amount_text(&found->with[e], &found->read, g->s->unit, amount);
        written += (size_t)snprintf(list + written, sizeof list - written, " (of %s)", amount);
    }
    if (found->more > 0) snprintf(list + written, sizeof list - written, " and %zu more", found->more);
    if (found->n > 0)
        import_warn(&g->s->warnings, "%s: these extensions are left out: %.1500s", g->path, list);
}

/* Tells of scenes beside the one that is read, and of nodes that stand in none. */
static void tell_scenes(const gltf_file *g, const left_out *found) {
    const size_t n = json_array_size(json_object_get(g->root, "scenes")), one = gltf_scene_read(g->root);
    gltf_amount all = found->read;
    char amount[GLTF_AMOUNT_TEXT];
    gltf_amount_add(&all, &found->unread);
    gltf_amount_text(&found->unread, &all, g->s->unit, amount);
    if (n > 1 && found->unread.faces > 0)
        import_warn(&g->s->warnings, "%s: of its %zu scenes only scenes[%zu] is read; faces are missing: %s",
                    g->path, n, one, amount);
    else if (n > 1)
        import_warn(&g->s->warnings, "%s: of its %zu scenes only scenes[%zu] is read, which has all faces",
                    g->path, n, one);
    else if (found->unread.faces > 0)
        import_warn(&g->s->warnings, "%s: faces are missing, as their nodes are in no scene: %s", g->path,
                    amount);
}

/* Finds faces where something is left out that they tell of. */
static lam_status tell_amounts(gltf_file *g, lam_error *error) {
    lam_status status = LAM_OK;
    left_out found = {.n = 0};
    gltf_nodes nodes = {.n = 0};
    find_extensions(g, &found);
    TRY(gltf_nodes_place(g->root, &nodes, error));
    if (found.n > 0 || nodes.n_read < nodes.n) add_faces(g, &nodes, &found);
    tell_scenes(g, &found);
    tell_extensions(g, &found);
done:
    gltf_nodes_free(&nodes);
    return status;
}

static bool any_weight(const json_t *owner) {
    size_t k;
    json_t *weight;
    bool any = false;
    json_array_foreach(json_object_get(owner, "weights"), k, weight) any = any || gltf_number(weight, 0) != 0;
    return any;
}

/* Tells of meshes that bones or shape keys would move. */
static void tell_moved(const gltf_file *g) {
    size_t i, skins = 0, shapes = 0;
    json_t *node;
    json_array_foreach(json_object_get(g->root, "nodes"), i, node) {
        const json_t *of = gltf_entry(g, "meshes", json_object_get(node, "mesh"));
        const bool keyed =
            json_object_get(json_array_get(json_object_get(of, "primitives"), 0), "targets") != NULL;
        skins += of != NULL && json_object_get(node, "skin") != NULL;
        shapes += keyed && any_weight(json_object_get(node, "weights") != NULL ? node : of);
    }
    if (skins > 0)
        import_warn(
            &g->s->warnings,
            "%s: the bones of %zu mesh%s (skins) are left out: each stands as it was modelled; apply the "
            "armature before the export",
            g->path, skins, skins == 1 ? "" : "es");
    if (shapes > 0)
        import_warn(
            &g->s->warnings,
            "%s: the shape keys of %zu mesh%s (targets) are left out: each has its basic shape; apply them "
            "before the export",
            g->path, shapes, shapes == 1 ? "" : "es");
}

/* Tells of primitives that are no faces. */
static void tell_lines(const gltf_file *g) {
    size_t i, k, n = 0;
    json_t *of, *primitive;
    json_array_foreach(json_object_get(g->root, "meshes"), i, of)
        json_array_foreach(json_object_get(of, "primitives"), k, primitive) n +=
        fabs(gltf_number(json_object_get(primitive, "mode"), 4) - 5) > 1;
    if (n > 0)
        import_warn(&g->s->warnings, "%s: %zu primitive%s of lines or points %s left out: no faces", g->path,
                    n, n == 1 ? "" : "s", n == 1 ? "is" : "are");
}

lam_status gltf_tell_left_out(gltf_file *g, lam_error *error) {
    import_warnings *w = &g->s->warnings;
    size_t i, bumps = 0, alphas = 0, metals = 0;
    json_t *m;
    json_array_foreach(json_object_get(g->root, "materials"), i, m) {
        const json_t *pbr = json_object_get(m, "pbrMetallicRoughness");
        const char *mode = json_string_value(json_object_get(m, "alphaMode"));
        bumps +=
            json_object_get(m, "normalTexture") != NULL || json_object_get(m, "occlusionTexture") != NULL;
        const double alpha = gltf_number(json_array_get(json_object_get(pbr, "baseColorFactor"), 3), 1);
        const bool blended = mode != NULL && strcmp(mode, "BLEND") == 0;
        alphas += mode != NULL && strcmp(mode, "OPAQUE") != 0 && !(blended && alpha < 1);
        metals += gltf_number(json_object_get(pbr, "metallicFactor"), 0) > 0 ||
                  json_object_get(pbr, "metallicRoughnessTexture") != NULL;
    }
    if (alphas > 0)
        import_warn(w, "%s: the alpha of %zu materials (MASK, or in an image) is left out; they are opaque",
                    g->path, alphas);
    if (bumps > 0)
        import_warn(w, "%s: normal and occlusion maps of %zu materials are left out", g->path, bumps);
    if (metals > 0)
        import_warn(w,
                    "%s: %zu materials are metallic or may be; they are diffuse here, of their base colour",
                    g->path, metals);
    tell_moved(g);
    tell_lines(g);
    return tell_amounts(g, error);
}
