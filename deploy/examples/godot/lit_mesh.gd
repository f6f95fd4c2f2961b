# Lights a mesh in Godot by lambertd: asks it for the elements of a scene once, and for their light whenever light() is called.
#
#   lambertd room.h5 &
#
# Add a node with this script to a scene, set the members below, and call light('{"groups":{"lamp":17}}'), an emission as requests have
# it, from a slider: of calls that come faster than answers the newest counts. The signal `lit` tells that its colours are shown.
# It is written for Godot 3.2 or later, in which a test runs it, and for Godot 4, whose other names of classes and functions are
# looked up when they are called.
extends Node

signal lit

var host = "127.0.0.1"
var port = 8317
var scene = "room"
var token = ""
var exposure = 1.0
var problem = ""  # what the daemon refused last, or the reason why it does not answer

var _new = Engine.get_version_info()["major"] >= 4
var _client = HTTPClient.new()
var _asked = null  # what is on its way: "mesh" or an emission
var _emission = null  # the newest one, which waits
var _body = null
var _child = null
var _vertices = []  # of all groups: [position, normal, element]
var _indices = []
var _elements = 0


func light(emission):
	_emission = emission


func _ready():
	_child = _make("MeshInstance", "MeshInstance3D")
	var material = _make("SpatialMaterial", "StandardMaterial3D")
	material.set("vertex_color_use_as_albedo", true)
	material.set("vertex_color_is_srgb", false)
	material.set("flags_unshaded", true)  # Godot 3
	material.set("shading_mode", 0)  # Godot 4
	_child.set("material_override", material)
	add_child(_child)


func _process(_delta):
	_client.poll()
	var status = _client.get_status()
	if status == HTTPClient.STATUS_BODY:
		var chunk = _client.read_response_body_chunk()
		if chunk.size() > 0:
			if _body == null:
				_body = chunk
			else:
				_body.append_array(chunk)
	elif status == HTTPClient.STATUS_CONNECTED:
		if _asked == null:
			_ask()
		else:
			_answered(_client.get_response_code())
	elif status == HTTPClient.STATUS_DISCONNECTED:
		_client.connect_to_host(host, port)
	elif not status in [HTTPClient.STATUS_RESOLVING, HTTPClient.STATUS_CONNECTING, HTTPClient.STATUS_REQUESTING]:
		problem = "the daemon at %s:%d does not answer" % [host, port]
		_asked = null
		_client.close()


func _ask():
	if _emission == null:
		return
	var path = "/v1/scenes/" + scene
	var headers = ["Accept: application/x-npy; dtype=f4", "Content-Type: application/json"]
	if token != "":
		headers.append("Authorization: Bearer " + token)
	if _elements == 0:
		headers[0] = "Accept: model/gltf-binary"
		_send("mesh", HTTPClient.METHOD_GET, path + "/mesh", headers, "")
	else:
		_send(_emission, HTTPClient.METHOD_POST, path + "/radiosity", headers, '{"emission":%s}' % _emission)


func _send(what, method, path, headers, body):
	if _client.request(method, path, headers, body) == OK:
		_asked = what
		_body = null


func _answered(status):
	var file = StreamPeerBuffer.new()
	if _body != null:
		file.data_array = _body
	if status != 200:
		problem = file.get_utf8_string(file.get_size())
		_emission = null  # it would be refused again
	elif _asked == "mesh":
		_read_mesh(file)
	else:
		problem = ""
		if _asked == _emission:
			_emission = null
		_show(file)
	_asked = null
	_client.close()  # a new request begins with no answer


# Binary glTF: a chunk of JSON, and one of numbers. Every element has vertices of its own.
func _read_mesh(file):
	file.seek(12)
	var length = file.get_u32()
	file.seek(20)
	var gltf = _json(file.get_utf8_string(length))
	var start = 20 + length + 8
	for mesh in gltf["meshes"]:
		for primitive in mesh["primitives"]:
			var first = _vertices.size()
			var positions = _numbers(file, gltf, primitive["attributes"]["POSITION"], start)
			var normals = _numbers(file, gltf, primitive["attributes"]["NORMAL"], start)
			var elements = _numbers(file, gltf, primitive["attributes"]["_ELEMENT"], start)
			for i in range(elements.size()):
				var normal = Vector3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2])
				_vertices.append([Vector3(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]), normal, int(elements[i])])
				_elements = int(max(_elements, elements[i] + 1))
			for index in _numbers(file, gltf, primitive["indices"], start):
				_indices.append(first + index)


func _numbers(file, gltf, which, start):
	var accessor = gltf["accessors"][int(which)]
	var view = gltf["bufferViews"][int(accessor["bufferView"])]
	var parts = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
	file.seek(int(start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)))
	var read = []
	for _i in range(int(accessor["count"]) * parts):
		read.append(file.get_u32() if int(accessor["componentType"]) == 5125 else file.get_float())
	return read


# NPY: a head whose length stands at byte 8, then a row of all elements for each channel.
func _show(file):
	file.seek(8)
	file.seek(10 + file.get_u16())
	var channels = (file.get_size() - file.get_position()) / (4 * _elements)
	var values = []
	for _i in range(channels * _elements):
		values.append(exposure * file.get_float())
	var surface = SurfaceTool.new()
	surface.begin(Mesh.PRIMITIVE_TRIANGLES)
	for vertex in _vertices:
		var last = _elements * (channels - 1) + vertex[2]
		var green = values[_elements + vertex[2]] if channels == 3 else values[vertex[2]]
		surface.call("set_color" if _new else "add_color", Color(values[vertex[2]], green, values[last] if channels == 3 else green))
		surface.call("set_normal" if _new else "add_normal", vertex[1])
		surface.add_vertex(vertex[0])
	# Triangles of glTF run counter-clockwise, those of Godot clockwise.
	for i in range(0, _indices.size(), 3):
		for k in [0, 2, 1]:
			surface.add_index(_indices[i + k])
	_child.set("mesh", surface.commit())
	emit_signal("lit")


func _make(before, now):
	return ClassDB.call("instantiate", now) if _new else ClassDB.call("instance", before)


func _json(text):
	if not _new:
		return Engine.get_singleton("JSON").call("parse", text).result
	var parser = ClassDB.call("instantiate", "JSON")
	parser.call("parse", text)
	return parser.get("data")
