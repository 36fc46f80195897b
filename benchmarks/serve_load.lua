-- Requests of a file, one after the other: each a decimal length, a line's end, and its bytes.
--   wrk ... -s serve_load.lua URL -- FILE [THINK]
-- THINK: milliseconds that a connection waits between two requests, on average; at random.

local requests, at = {}, 0

function init(args)
  local file = assert(io.open(args[1], "rb"))
  while true do
    local length = file:read("*n")
    if length == nil then break end
    file:read(1)
    requests[#requests + 1] = file:read(length)
  end
  file:close()
  local think = tonumber(args[2] or 0)
  if think > 0 then
    math.randomseed(1)
    function delay() return math.floor(-think * math.log(1 - math.random()) + 0.5) end
  end
end

function request()
  at = at % #requests + 1
  return requests[at]
end

function done(summary, latency, _)
  local errors = summary.errors
  io.write(string.format(
    '\n{"requests": %d, "seconds": %f, "median": %f, "p99": %f, "bytes": %d, "wrong": %d}\n',
    summary.requests, summary.duration / 1e6,
    latency:percentile(50) / 1e6, latency:percentile(99) / 1e6, summary.bytes,
    errors.connect + errors.read + errors.write + errors.status + errors.timeout))
end
