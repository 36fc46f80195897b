/** Clips and poses as three.js has them; the same functions as for answers of the service. */

export { animationClip, applyPose, nodeNames, type Rig, skeletonOf } from "@posefield/client/three";
