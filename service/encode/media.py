"""Media types of the formats that hold numbers."""

JSON = "application/json"
ARROW = "application/vnd.apache.arrow.stream"
MSGPACK = "application/vnd.msgpack"
# Nobody has registered an archive of arrays; as a zip some browsers would unpack it.
NPZ = "application/x-npz"
