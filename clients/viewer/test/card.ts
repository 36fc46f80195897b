/** A small model's card for tests that need no service: a leg and an arm, two controls. */

import type { ModelCard } from "@posefield/client";

export const CARD = {
  identity: "hop@0123456789abcdef",
  name: "hop",
  description: "Hops",
  controls: [
    {
      name: "speed",
      unit: "m/s",
      description: "",
      minimum: 0.5,
      maximum: 2,
      default: 1,
      values: [],
    },
    {
      name: "time",
      unit: "deg",
      description: "",
      minimum: -20,
      maximum: 20,
      default: 0,
      values: [],
    },
  ],
  skeleton: {
    names: ["Hips", "Leg", "Foot", "Arm"],
    parents: [-1, 0, 1, 0],
    offsets: [
      [0, 0, 0],
      [0.1, -0.4, 0],
      [0, -0.4, 0.05],
      [0.2, 0.5, 0],
    ],
    tip_joints: [2],
    tip_offsets: [[0, 0, 0.1]],
  },
  units: {},
  cyclic: true,
  root: "travelling",
  rate: 120,
  frames: 60,
  samples: 3,
  levels: [{}, {}, {}, {}],
  durations: [1, 2],
  labels: [
    { name: "performer", names: ["ann", "bob & co"], clips: [] },
    { name: "style", names: ["calm", "in a hurry"], clips: [] },
    { name: "mood", names: ["glad", "sad"], clips: [] },
  ],
  performers: ["ann", "bob & co"],
  examples: [],
  moved_by: [],
  feet: [],
  diagnostics: {},
  provenance: {},
  roles: {},
  sources: [],
  kriging: null,
} as unknown as ModelCard;
