# Reads glTF files that the editor has imported, with Godot 3: --script godot_read.gd
#
# requests.json of the project gives the times, s, of each file's frames. found.json gets the bones of
# each file and, for each frame, their matrices in the world, 12 numbers by column: Y up, metres.
# Without an animation there are no frames.
extends SceneTree


func _initialize():
	var found = {}
	var requests = _read("res://requests.json")
	for name in requests:
		found[name] = _motion(name, requests[name])
	var result = File.new()
	result.open("res://found.json", File.WRITE)
	result.store_string(to_json(found))
	result.close()
	quit()


func _read(path):
	var file = File.new()
	file.open(path, File.READ)
	return parse_json(file.get_as_text())


func _motion(name, times):
	var scene = load("res://" + name).instance()
	get_root().add_child(scene)
	var skeleton = _first(scene, "Skeleton")
	var player = _first(scene, "AnimationPlayer")
	var joints = []
	for bone in skeleton.get_bone_count():
		joints.append(skeleton.get_bone_name(bone))
	var matrices = []
	if player:
		player.current_animation = player.get_animation_list()[0]
		for time in times:
			player.seek(time, true)
			matrices.append(_pose(skeleton))
	scene.free()
	return {"joints": joints, "matrices": matrices}


func _first(node, kind):
	if node.is_class(kind):
		return node
	for child in node.get_children():
		var found = _first(child, kind)
		if found:
			return found
	return null


func _pose(skeleton):
	var found = []
	for bone in skeleton.get_bone_count():
		var at = skeleton.global_transform * skeleton.get_bone_global_pose(bone)
		for vector in [at.basis.x, at.basis.y, at.basis.z, at.origin]:
			found.append([vector.x, vector.y, vector.z])
	return found
