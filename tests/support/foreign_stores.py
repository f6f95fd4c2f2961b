"""Makes files that are not quite stores out of a sound sample: foreign_stores.py SAMPLE.h5

Writes NAME.h5 beside the sample and prints each NAME. The answers that a reader must give stand in
tests/stress/test_store_weather.c.
"""

import ctypes
import ctypes.util
import pathlib
import shutil
import struct
import sys

import h5py
import numpy as np

makers = {}


def foreign(maker):
    makers[maker.__name__] = maker
    return maker


def text(value):
    return np.array(value.encode(), dtype=f"S{len(value.encode())}")[()]


def replace(store, name, **how):
    """Puts another dataset in the place of one."""
    old = store[name][()]
    del store[name]
    if not how:
        how = {"data": old}
    return store.create_dataset(name, **how)


@foreign
def sound(store):
    pass


@foreign
def format_other(store):
    store.attrs["format"] = text("lamp")


@foreign
def format_number(store):
    store.attrs["format"] = 1


@foreign
def format_variable(store):
    store.attrs["format"] = "lambert"  # h5py writes a text of variable length


@foreign
def version_newer(store):
    store.attrs.modify("version", 2)


@foreign
def version_zero(store):
    store.attrs.modify("version", 0)


@foreign
def version_text(store):
    store.attrs["version"] = text("1")


@foreign
def version_absent(store):
    del store.attrs["version"]


@foreign
def checksum_absent(store):
    del store["checksum"]


@foreign
def checksum_array(store):
    del store["checksum"]
    store["checksum"] = np.zeros(3)


@foreign
def checksum_unsummed(store):
    del store["checksum"].attrs["xxh3"]


@foreign
def checksum_other(store):
    store["checksum/mesh/area"][0] ^= np.uint64(1)


@foreign
def checksum_forged(store):
    """An array changed and its checksum with it, but not the checksum of checksums."""
    store["mesh/area"][7] = 1.0
    raw = store["mesh/area"][()].tobytes()
    library = ctypes.CDLL(ctypes.util.find_library("xxhash"))
    library.XXH3_64bits.restype = ctypes.c_uint64
    library.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    store["checksum/mesh/area"][0] = np.uint64(library.XXH3_64bits(raw, len(raw)))


@foreign
def checksum_f64(store):
    replace(store, "checksum/mesh/area", data=np.zeros(1))


@foreign
def checksum_one_gone(store):
    del store["checksum/mesh/area"]


@foreign
def array_changed(store):
    store["mesh/area"][7] = 1.0


@foreign
def array_gone(store):
    del store["mesh/area"]


@foreign
def array_added(store):
    store["mesh/mine"] = np.zeros(3)


@foreign
def array_chunked(store):
    replace(store, "mesh/area", data=store["mesh/area"][()], chunks=(5,))


@foreign
def array_compressed(store):
    replace(store, "mesh/area", data=store["mesh/area"][()], compression="gzip")


@foreign
def array_external(store):
    replace(store, "mesh/area", shape=(23,), dtype="<f8", external=[("/etc/passwd", 0, 184)])


@foreign
def array_virtual(store):
    del store["mesh/area"]
    layout = h5py.VirtualLayout(shape=(23,), dtype="<f8")
    layout[:] = h5py.VirtualSource("sample.h5", "mesh/area", shape=(23,))
    store.create_virtual_dataset("mesh/area", layout)


@foreign
def array_unallocated(store):
    replace(store, "mesh/area", shape=(23,), dtype="<f8")


@foreign
def array_huge(store):
    replace(store, "mesh/area", shape=(2**40,), dtype="<f8")


@foreign
def array_big_endian(store):
    replace(store, "mesh/area", data=store["mesh/area"][()].astype(">f8"))


@foreign
def array_compound(store):
    replace(store, "mesh/area", data=np.zeros(23, dtype=[("a", "<f4"), ("b", "<f4")]))


@foreign
def array_rank_5(store):
    replace(store, "mesh/area", data=np.zeros((23, 1, 1, 1, 1)))


@foreign
def array_scalar(store):
    replace(store, "mesh/area", data=np.float64(1))


@foreign
def array_empty(store):
    replace(store, "mesh/area", data=h5py.Empty("<f8"))


@foreign
def array_is_group(store):
    del store["mesh/area"]
    store.create_group("mesh/area")


@foreign
def texts_variable(store):
    replace(store, "mesh/group_names", data=["a", "b", "c", "d", "e"], dtype=h5py.string_dtype())


@foreign
def link_soft(store):
    del store["mesh/area"]
    store["mesh/area"] = h5py.SoftLink("/form_factors/indptr")


@foreign
def link_dangling(store):
    store["mesh/mine"] = h5py.SoftLink("/nowhere")


@foreign
def link_external(store):
    store["mesh/mine"] = h5py.ExternalLink("sample.h5", "/mesh/area")


@foreign
def link_cycle(store):
    store["mesh/error"] = store["error"]
    store["error/mesh"] = store["mesh"]
    store["error/root"] = store["/"]


@foreign
def groups_deep(store):
    group = store
    for _ in range(2000):
        group = group.create_group("g")


@foreign
def name_long(store):
    store.create_group("g" * 5000)


@foreign
def type_committed(store):
    store["mesh/kind"] = np.dtype("<f8")


def lookup3(data):
    """The checksum of HDF5's headers: Bob Jenkins' hashlittle."""
    low = 0xFFFFFFFF

    def rotate(x, k):
        return (x << k | x >> (32 - k)) & low

    h = [(0xDEADBEEF + len(data)) & low] * 3
    blocks = max(1, -(-len(data) // 12))
    words = struct.unpack(f"<{3 * blocks}I", data.ljust(12 * blocks, b"\0"))
    for block in range(blocks):
        h = [(x + y) & low for x, y in zip(h, words[3 * block : 3 * block + 3])]
        if block == blocks - 1:
            break
        for i, k in enumerate((4, 6, 8, 16, 19, 4)):
            x, before, after = i % 3, (i + 2) % 3, (i + 1) % 3
            h[x] = (h[x] - h[before] & low) ^ rotate(h[before], k)
            h[before] = (h[before] + h[after]) & low
    for i, k in enumerate((14, 11, 25, 16, 4, 14, 24)):
        x, y = (i + 2) % 3, (i + 1) % 3
        h[x] = (h[x] ^ h[y]) - rotate(h[y], k) & low
    return h[2]


def forge(sample, path, *changes):
    """A copy in which the header of /mesh/area says something else, under a right checksum: each change is
    (old, new), two 64-bit numbers."""
    with h5py.File(sample, "r") as store:
        at = h5py.h5o.get_info(store["mesh/area"].id).addr
    content = bytearray(sample.read_bytes())
    assert content[at : at + 6] == b"OHDR\x02\x01", "a header without times, its size in two bytes"
    end = at + 8 + struct.unpack_from("<H", content, at + 6)[0]
    assert struct.unpack_from("<I", content, end)[0] == lookup3(content[at:end])
    for old, new in changes:
        header = bytes(content[at:end])
        assert header.count(struct.pack("<Q", old)) >= 1, old
        content[at:end] = header.replace(struct.pack("<Q", old), struct.pack("<Q", new))
    struct.pack_into("<I", content, end, lookup3(content[at:end]))
    path.write_bytes(content)


def forgeries(sample):
    with h5py.File(sample, "r") as store:
        place, size = store["mesh/area"].id.get_offset(), store["mesh/area"].nbytes
    count = size // 8
    return {
        "forged_size": [(count, 2**40), (size, 2**43)],
        "forged_wrap": [(count, 2**61 + count)],  # times 8 it is the true size again, in 64 bits
        "forged_storage": [(count, count - 1)],
        "forged_place": [(place, sample.stat().st_size - size + 1)],
    }


def main(sample):
    folder = sample.parent
    for name, make in makers.items():
        path = folder / f"{name}.h5"
        shutil.copyfile(sample, path)
        with h5py.File(path, "r+") as store:
            make(store)
        print(name)
    for name, changes in forgeries(sample).items():
        forge(sample, folder / f"{name}.h5", *changes)
        print(name)
    for name, version in (("plain_hdf5", "earliest"), ("plain_hdf5_new", "latest")):
        with h5py.File(folder / f"{name}.h5", "w", libver=version) as plain:
            plain["x"] = np.arange(10.0)
            plain.attrs["version"] = 1
        print(name)
    with h5py.File(sample, "r") as store, h5py.File(folder / "headers_unsummed.h5", "w") as plain:
        for item in store:
            store.copy(item, plain)
        for name, value in store.attrs.items():
            plain.attrs.create(name, value, dtype=store.attrs.get_id(name).dtype)
    print("headers_unsummed")


main(pathlib.Path(sys.argv[1]))
