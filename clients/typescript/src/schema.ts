// Generated from api/openapi.yaml by `npm run generate`: change the contract, not this.
export interface paths {
    "/v1/models": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /** List the models */
        get: operations["listModels"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a model's card
         * @description The card describes the model: its controls and their ranges, its skeleton, and the measurements of its training.
         */
        get: operations["getModel"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/character.glb": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a model's character
         * @description The character of the model at rest as binary glTF 2.0: its joints and the body of all files, skinned to them, without motion. The vertex attributes `_ANCHORS` (two joints) and `_SHARE` fit the body to bones of other lengths, such as another performer's: a vertex moves by `1 - _SHARE` of the displacement of the first joint at rest, and `_SHARE` of the second's. The mesh `BodyCoarse`, which no node draws, has fewer triangles on the same vertices.
         */
        get: operations["getCharacter"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/pose": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get poses at given times
         * @description The response is JSON, or the format that `Accept` prefers.
         */
        get: operations["getPose"];
        put?: never;
        /**
         * Query poses at given times
         * @description The response is JSON, or the format that `Accept` prefers. For poses at many control points use the crowd operations.
         */
        post: operations["queryPose"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/pose.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        /**
         * Get poses at given times in a format
         * @description The response is `json`, `msgpack`, `npz` or `arrow`.
         */
        get: operations["getPoseInFormat"];
        put?: never;
        /**
         * Query poses at given times in a format
         * @description The response is `json`, `msgpack`, `npz` or `arrow`.
         */
        post: operations["queryPoseInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/clip": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a clip in an accepted format
         * @description The response is binary USD, or the format that `Accept` prefers. Each format also has its own path.
         */
        get: operations["getClip"];
        put?: never;
        /**
         * Query a clip in an accepted format
         * @description The response is binary USD, or the format that `Accept` prefers. Each format also has its own path.
         */
        post: operations["queryClip"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/clip.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack; of a model of a robot also a reference motion, such as `mjlab.npz` (since 5.2.0).
                 * @example usda
                 */
                format: components["parameters"]["clipEnding"];
            };
            cookie?: never;
        };
        /**
         * Get a clip in a format
         * @description The response is `usda`, `usdc`, `usdz`, `json`, `bvh`, `glb`, `vrma`, `npz`, `arrow` or `msgpack`. By default lengths are in metres and Y is up. BVH files are in centimetres by default. glTF and VRM animations are always in metres with Y up. A model of a robot also has the reference motions that programs which train robots read, such as `mjlab.npz`, always in metres with Z up. These and `vrma` are there since 5.2.0.
         */
        get: operations["getClipInFormat"];
        put?: never;
        /**
         * Query a clip in a format
         * @description The response is `usda`, `usdc`, `usdz`, `json`, `bvh`, `glb`, `vrma`, `npz`, `arrow` or `msgpack`. By default lengths are in metres and Y is up. BVH files are in centimetres by default. glTF and VRM animations are always in metres with Y up. A model of a robot also has the reference motions that programs which train robots read, such as `mjlab.npz`, always in metres with Z up. These and `vrma` are there since 5.2.0.
         */
        post: operations["queryClipInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/clips": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query many clips as an archive
         * @description The response is a zip archive, or the format that `Accept` prefers. The archive is sent while the clips are computed. It contains one file per clip, under the clip's name, in the order of the request; each file equals the response of the clip path in that format. The last file is `manifest.jsonl`; a response without it is incomplete.
         */
        post: operations["queryClips"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/clips.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description A zip or tar archive.
                 * @example zip
                 */
                format: components["parameters"]["archiveFormat"];
            };
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query many clips as an archive in a format
         * @description The response is `zip` or `tar`. The archive is sent while the clips are computed. It contains one file per clip, under the clip's name, in the order of the request; each file equals the response of the clip path in that format. The last file is `manifest.jsonl`; a response without it is incomplete.
         */
        post: operations["queryClipsInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/crowd": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a walking crowd in an accepted format
         * @description The response is binary USD, or the format that `Accept` prefers. Each character walks on its own path at its own varying speed; the same seed gives the same crowd. Requires a cyclic model whose root travels at several speeds. USDZ is sent while it is written; a single layer is sent when it is complete.
         */
        get: operations["getCrowd"];
        put?: never;
        /**
         * Query poses of a crowd in an accepted format
         * @description The response is an Arrow stream, or the format that `Accept` prefers. Use it also for poses at many control points: each is a character at the origin.
         */
        post: operations["queryCrowd"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/crowd.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a walking crowd in a format
         * @description The response is `usda`, `usdc` or `usdz`. Each character walks on its own path at its own varying speed; the same seed gives the same crowd. Requires a cyclic model whose root travels at several speeds. USDZ is sent while it is written; a single layer is sent when it is complete.
         */
        get: operations["getCrowdInFormat"];
        put?: never;
        /**
         * Query poses of a crowd in a format
         * @description The response is `arrow`, `npz`, `msgpack`, or `json` for at most 1,000 characters.
         */
        post: operations["queryCrowdInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/tracks.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query people who follow tracks, in a format
         * @description Each person is where its track is at each time, and walks, turns or stands there; before and after its track it is hidden. The response has the bytes that `posefield crowd --trajectories` writes. Requires a cyclic model whose root travels at several speeds. What no walker can do is told in warnings, at most 20 and the number of the others. Since 5.2.0.
         */
        post: operations["queryTracksInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/why": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get the captured clips behind a response
         * @description Lists the captured clips nearest to the controls, and the weight of each in the poses of the finest level.
         */
        get: operations["getWhy"];
        put?: never;
        /**
         * Query the captured clips behind a response
         * @description Lists the captured clips nearest to the controls, and the weight of each in the poses of the finest level.
         */
        post: operations["queryWhy"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/suggestions": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get suggested clips to capture
         * @description Lists control points within the sampled ranges, ranked by the expected reduction of the kriging variance if one clip is captured there. The most useful point is first.
         */
        get: operations["getSuggestions"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/sigma": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get sigma over two controls
         * @description Sigma is the expected distance (m) of a captured clip from the response. The grid holds sigma for all values of two controls, at the finest level of detail, and whether clips with similar controls were captured. The response is JSON, or the format that `Accept` prefers.
         */
        get: operations["getSigma"];
        put?: never;
        /**
         * Query sigma over two controls
         * @description Sigma is the expected distance (m) of a captured clip from the response. The grid holds sigma for all values of two controls, at the finest level of detail, and whether clips with similar controls were captured. The response is JSON, or the format that `Accept` prefers.
         */
        post: operations["querySigma"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{model}/sigma.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        /**
         * Get sigma over two controls in a format
         * @description The response is `json`, `msgpack`, `npz` or `arrow`. Sigma is the expected distance (m) of a captured clip from the response. The grid holds sigma for all values of two controls, at the finest level of detail, and whether clips with similar controls were captured.
         */
        get: operations["getSigmaInFormat"];
        put?: never;
        /**
         * Query sigma over two controls in a format
         * @description The response is `json`, `msgpack`, `npz` or `arrow`. Sigma is the expected distance (m) of a captured clip from the response. The grid holds sigma for all values of two controls, at the finest level of detail, and whether clips with similar controls were captured.
         */
        post: operations["querySigmaInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/characters": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * List the characters of users
         * @description Rigs in USD and glTF files of the folder of the operator, read when the service starts, and the files that could not be read. Since 4.3.0.
         */
        get: operations["listCharacters"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/performances": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query a performance in an accepted format
         * @description A performance is one continuous motion of one character through the segments of a script: walks, acts of models without cycle, and holds. The response is JSON, or the format that `Accept` prefers. The same script gives the same bytes. With `plan=true` it is JSON without the poses: timeline, joins, targets and warnings. Since 4.1.0.
         */
        post: operations["queryPerformance"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/performances.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack.
                 * @example usda
                 */
                format: components["parameters"]["clipFormat"];
            };
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query a performance in a format
         * @description The response is the whole performance as `usda`, `usdc`, `usdz`, `json`, `bvh`, `glb`, `vrma`, `npz`, `arrow` or `msgpack`. Only `json` has a plan. Since 4.1.0.
         */
        post: operations["queryPerformanceInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/performances/batch": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query many performances as an archive
         * @description The response is a zip archive, or the format that `Accept` prefers. Every script is planned before the response begins, and one that cannot be performed refuses the whole request; the archive is sent while the performances are computed. It contains one file per script, under the script's name, in the order of the request; each file equals the response of the performance path in that format and layout. The last file is `manifest.jsonl`; a response without it is incomplete. Since 4.2.0.
         */
        post: operations["queryPerformances"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/performances/batch.{format}": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description A zip or tar archive.
                 * @example zip
                 */
                format: components["parameters"]["archiveFormat"];
            };
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Query many performances as an archive in a format
         * @description The response is `zip` or `tar`. Every script is planned before the response begins, and one that cannot be performed refuses the whole request; the archive is sent while the performances are computed. It contains one file per script, under the script's name, in the order of the request; each file equals the response of the performance path in that format and layout. The last file is `manifest.jsonl`; a response without it is incomplete. Since 4.2.0.
         */
        post: operations["queryPerformancesInFormat"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/metrics": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get metrics
         * @description Prometheus metrics: latency by operation, format and status, open requests, poses per batch,
         *     responses with 304, and versions of models.
         */
        get: operations["getMetrics"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/livez": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /** Check liveness */
        get: operations["getLiveness"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/readyz": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Check readiness
         * @description The service evaluates a trial request on the newest model of each name, at most once a
         *     second. The output must equal the output at the opening of the model. New model files that
         *     cannot be used are listed; the previous version stays in service. The status is 503 if an
         *     output differs, if there is no model, and from the moment at which the service is told to
         *     stop.
         */
        get: operations["getReadiness"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/openapi.yaml": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get this document
         * @description The response equals the source file byte for byte, including its comments.
         */
        get: operations["getContract"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/openapi.json": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get this document as JSON
         * @description The same content for clients without a YAML parser.
         */
        get: operations["getContractJson"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Open the model viewer
         * @description HTML page with sliders, an animated character and the uncertainty of the responses. The page loads nothing but the responses of this service.
         */
        get: operations["getViewer"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/docs": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Read the documentation of the operations
         * @description HTML page to read and try all operations. The page loads no external resources.
         */
        get: operations["getDocs"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/problems": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Read the documentation of the problems
         * @description HTML page. A problem's entry is at the fragment `#` with the last part of its `type`.
         */
        get: operations["getProblems"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
}
export type webhooks = Record<string, never>;
export interface components {
    schemas: {
        /** @description Identity of a model, name@hash. Responses under it never change. */
        Identity: string;
        /**
         * @description Naming convention of the joints: `own` keeps the names of the training data; the others are
         *     the names of Mixamo, Unreal's mannequin, VRM or HumanIK for joints with one of the card's
         *     `roles`. Joints without a role keep their names. Only names change. Bones keep their axes
         *     and lengths, so the motion must still be retargeted to a character of that convention. A
         *     model without roles accepts only `own`.
         * @default own
         * @enum {string}
         */
        Names: "own" | "mixamo" | "ue5" | "vrm" | "humanik";
        /**
         * @description `bone` adds a joint `root` on the floor above the hips to USD, glTF and BVH files. It carries
         *     travel and heading, without sway; bob, sway and lean stay in the hips, and all other joints
         *     are where they are without it. A character of a user needs a joint above its hips. Default:
         *     `bone` with `names=ue5`, else `travelling`. `bone` since 5.1.0.
         *
         *     `in_place` removes the travel of the root. For a cycle it removes the frame that moves
         *     evenly along the cycle's arc, including its heading. For another motion it removes the
         *     straight line from the first pose of the whole clip to the last, at constant speed, and
         *     keeps the heading. Heights are kept. A model that was trained in place is unchanged.
         * @default null
         * @enum {string|null}
         */
        Root: "travelling" | "in_place" | "bone" | null;
        /**
         * @description Whether the hips travel, or a joint `root` on the floor above them, as of clips. Default:
         *     `bone` with `names=ue5`, else `travelling`. Since 5.1.0.
         * @default null
         * @enum {string|null}
         */
        PerformanceRoot: "travelling" | "bone" | null;
        /**
         * @description One whole cycle in N = max(1, round(duration * fps)) even steps, which gives N + 1 frames.
         *     Not valid with `start` or `end`. The last frame equals the first exactly or, if the root
         *     travels, equals the first moved by the travel and the turn of the cycle. The file plays for
         *     N / fps seconds, and `stretch` in the trust is the difference to its `duration`, which is
         *     the model's. A model that is not cyclic refuses it.
         * @default false
         */
        Loop: boolean;
        /**
         * @description Whether the trust includes sigma for each joint, as `joint_sigma`. Files without trust (BVH) omit it.
         * @default false
         */
        JointSigma: boolean;
        /**
         * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
         *     model can measure on a motion: those with a `measure` on its card, except measures of the
         *     performer's body), `none`, or names of controls. Among the motions that match, the response
         *     is the one closest to the prediction, in the metric of the deviations of captured motions
         *     from their predictions.
         * @default auto
         */
        Exact: ("auto" | "none") | components["schemas"]["ControlName"][];
        /**
         * @description Target position of a joint at a moment. The moment is a time, the start, the end, the event
         *     that the model's recipe names, or the moment at which the joint is highest, lowest or
         *     farthest from the root. Among the motions that reach the target, the response is the one
         *     closest to the prediction, in the metric of the deviations of captured motions from their
         *     predictions. A target beyond these deviations is approached as far as they extend, and
         *     `targets` in Trust gives the remaining distance, that of a clip in the frame at the moment.
         *     Each joint has at most one target at a moment.
         */
        Target: {
            /**
             * @description Name of a joint in the model's skeleton.
             * @example RightHand
             */
            joint: string;
            /**
             * @description Target position x y z in metres, in the frame of the clip, in which the root travels.
             * @example [
             *       0.3,
             *       1.2,
             *       0.4
             *     ]
             */
            position: number[];
            /** @description Seconds from the start of the clip, at most its duration. */
            time?: number;
            at?: components["schemas"]["Moment"];
        } & (unknown | unknown);
        /** @enum {string} */
        Moment: "start" | "end" | "event" | "highest" | "lowest" | "farthest";
        /**
         * @description Target positions of joints. With `exact` set to `auto`, a target replaces a control that is measured as the position of the same joint at the same moment.
         * @default []
         * @example [
         *       {
         *         "joint": "RightHand",
         *         "position": [
         *           0.3,
         *           1.2,
         *           0.4
         *         ],
         *         "at": "end"
         *       }
         *     ]
         */
        Targets: components["schemas"]["Target"][];
        /**
         * @description Whether feet stand where they contact the ground. `stand` plans stances and swings over the whole motion, keeps standing feet in one place on the floor, and places the legs; exact targets and controls stay met. Default: `stand` for models that travel and know the contacts of their feet. Since 4.0.0.
         * @default null
         * @enum {string|null}
         */
        FeetMode: "stand" | "as_predicted" | null;
        /** @description Plane in the frame of the clip. Since 4.0.0. */
        Floor: {
            /** @description Height at the origin in metres. */
            height: number;
            /** @description Rise for each metre along x. */
            slope_x: number;
            /** @description Rise for each metre along z. */
            slope_z: number;
        };
        /**
         * @description Floor on which feet stand, in the frame of the clip: its height in metres, or a plane, which rises by at most 0.3 m for each metre. Stances, swings and the pelvis follow it, and feet are tilted as it is; exact targets and controls stay met. Refused where feet are as predicted, and with a slope for loops and `in_place`. Since 4.0.0.
         * @default 0
         * @example {
         *       "height": 0.1,
         *       "slope_x": 0,
         *       "slope_z": 0.15
         *     }
         */
        FloorValue: number | components["schemas"]["Floor"];
        /**
         * @description Seed of another take of the motion, equal for equal seeds. 0 is the prediction. A take deviates as captured clips do; `sigma` stays that of the prediction, and exact controls and targets are met.
         * @default 0
         */
        Take: number;
        /**
         * @description Size of a take's deviations from the prediction; 1 is that of captured clips.
         * @default 0.7
         */
        Variety: number;
        /**
         * @description Whether to add details of a cycle that no control predicts, sampled by the take's seed.
         * @default false
         */
        Detail: boolean;
        /**
         * @description Unit of length in the file; null for the format's usual unit. glTF is always in metres.
         * @default null
         * @enum {string|null}
         */
        Unit: "m" | "cm" | null;
        /**
         * @description Up axis of the file; null for the format's usual axis. With `z`, a character that faces straight ahead faces -Y. In glTF Y is always up.
         * @default null
         * @enum {string|null}
         */
        Up: "y" | "z" | null;
        /**
         * @description Body in USD and glTF files. `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone; null for `mannequin`. Formats without a body refuse it.
         * @default null
         * @enum {string|null}
         */
        Body: "none" | "mannequin" | "bones" | null;
        /**
         * @description Character of a user that moves, one of `/v1/characters`; null for the character of the model. `names`, `body`, `unit` and `up` follow from its file. Since 4.3.0.
         * @default null
         * @example hero
         */
        CharacterName: string | null;
        /**
         * @description Policy for clips in which a joint of a robot turns beyond its limits. `report` gives the clip
         *     with `limits` in its trust, and one warning for each such joint; `refuse` returns an error.
         *     Without effect for models of no robot. Since 5.2.0.
         * @default report
         * @enum {string}
         */
        Limits: "refuse" | "report";
        /** @description A joint of a robot beyond its limits, where it is worst. Since 5.2.0. */
        BrokenLimit: {
            /** @description Name of the joint. */
            joint: string;
            /** @description Time of the frame from the first, in seconds. */
            time: number;
            /** @description Its angle in radians. */
            angle: number;
            /** @description Its least and largest angle in radians. */
            limits: number[];
        };
        /**
         * @description Policy for controls without similar captured clips and for targets out of reach. `ok`
         *     reports the controls only in `supported`. `warn` adds one sentence for each control outside
         *     its sampled range, or one sentence if the controls lie in a gap between the samples, and one
         *     sentence for each target out of reach. `refuse` returns an error in all these cases.
         * @default warn
         * @enum {string}
         */
        Extrapolate: "ok" | "warn" | "refuse";
        /**
         * @description Performer, one of `performers` on the model's card; null for an unseen performer.
         * @default null
         * @example tall
         */
        Performer: string | null;
        /** @description One name of a label set, or a weight for each of several names. */
        Label: string | {
            [key: string]: number;
        };
        /**
         * @description Name or weights by label set, one of `labels` on the model's card: `{"style": "angry"}` or
         *     `{"style": {"angry": 0.7, "happy": 0.3}}`. The sum of the weights is above 0 and at most 1; what
         *     is left to 1 stays open, as do sets that are not given. `performer` is short for the label set
         *     of that name; only one of both may be given. Since 3.1.0.
         * @default {}
         * @example {
         *       "performer": "tall"
         *     }
         */
        Labels: {
            [key: string]: components["schemas"]["Label"];
        };
        /**
         * @description Level of detail, an index into `levels` on the model's card; 0 is the finest.
         * @default 0
         * @example 1
         */
        LevelNumber: number;
        /**
         * @description A number for each control of the model, in the control's unit. A request may omit some or
         *     all of them, except a request for a crowd. Omitted controls are set to their conditional
         *     mean, given the other controls, the performer and the targets.
         * @example {
         *       "stature": 1.72,
         *       "hip_height": 0.9,
         *       "turn": 20,
         *       "target_height": 1.1
         *     }
         */
        Controls: {
            [key: string]: number;
        };
        PoseQuestion: {
            controls: components["schemas"]["Controls"];
            /**
             * @description Seconds from the start of the clip, at most its duration.
             * @example [
             *       0,
             *       0.5
             *     ]
             */
            times: number[];
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            labels?: components["schemas"]["Labels"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            take?: components["schemas"]["Take"];
            variety?: components["schemas"]["Variety"];
            detail?: components["schemas"]["Detail"];
        };
        ClipQuestion: {
            controls: components["schemas"]["Controls"];
            /**
             * @description Frame rate in frames a second.
             * @default 30
             */
            fps: number;
            /**
             * @description Time of the first frame in seconds.
             * @default 0
             */
            start: number;
            /**
             * @description Latest time of the last frame in seconds; null for the clip's duration.
             * @default null
             */
            end: number | null;
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            labels?: components["schemas"]["Labels"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["Root"];
            loop?: components["schemas"]["Loop"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            feet?: components["schemas"]["FeetMode"];
            floor?: components["schemas"]["FloorValue"];
            limits?: components["schemas"]["Limits"];
            take?: components["schemas"]["Take"];
            variety?: components["schemas"]["Variety"];
            detail?: components["schemas"]["Detail"];
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
            body?: components["schemas"]["Body"];
            character?: components["schemas"]["CharacterName"];
        };
        /** @default 10 */
        Nearest: number;
        /**
         * @description Point on the floor: x to the left and z forward of the world, in metres.
         * @example [
         *       0.5,
         *       3
         *     ]
         */
        FloorPoint: number[];
        /**
         * @description Pairs of a distance or time from the start of the segment and a value, in increasing order; linear between them, constant before the first and after the last.
         * @example [
         *       [
         *         0,
         *         0.9
         *       ],
         *       [
         *         3,
         *         1.4
         *       ]
         *     ]
         */
        NumberCurve: number[][];
        /**
         * @description Speed in metres a second: a number, or a curve over `speed_over`. By default the mean of the captured clips.
         * @default null
         */
        Speed: number | components["schemas"]["NumberCurve"] | null;
        /**
         * @description Rate of turning to the left in radians a second: a number, or a curve over the seconds of the segment. For a walk of `seconds` only.
         * @default null
         */
        Turn: number | components["schemas"]["NumberCurve"] | null;
        /**
         * @description `rolling` begins or ends at full speed. `standing` begins or ends at rest with the feet beside each other: no captured clip does, so the step that leads there is synthesised.
         * @default rolling
         * @enum {string}
         */
        GaitEnd: "rolling" | "standing";
        /**
         * @description Values of controls of the model; omitted controls are inferred.
         * @default {}
         */
        GivenControls: {
            [key: string]: number;
        };
        /** @description Join of a segment with the one before it. */
        Join: {
            /**
             * @description Duration of the blend in seconds. By default 0.5, between gaits 0.3.
             * @default null
             */
            seconds: number | null;
            /**
             * @description `dead` continues the motion before with a velocity that decays while the next one fades in, `hermite` lets the difference of both fade out, `cut` blends nothing. `auto` is `hermite` into a walk, else `dead`.
             * @default auto
             * @enum {string}
             */
            blend: "auto" | "dead" | "hermite" | "cut";
            /**
             * @description `best` joins at the frames that are most alike, `end` at the last frame before and the first one after.
             * @default best
             * @enum {string}
             */
            cut: "best" | "end";
            /**
             * @description Largest distance of the poses at the cut in metres; a join beyond it is refused.
             * @default null
             */
            most: number | null;
        };
        /** @description Target position of a joint at a moment of a segment. */
        PlacedTarget: {
            /**
             * @description Name of a joint of the model's skeleton.
             * @example RightHand
             */
            joint: string;
            /**
             * @description Position x y z in metres, in `frame`.
             * @example [
             *       0.3,
             *       1.2,
             *       4
             *     ]
             */
            position: number[];
            /** @description Seconds from the start of the segment's motion, at most its duration. */
            time?: number;
            at?: components["schemas"]["Moment"];
            /**
             * @description Frame of the position. That of a segment has its origin and heading at the first pose.
             * @default world
             * @enum {string}
             */
            frame: "world" | "segment";
        } & (unknown | unknown);
        /** @description Segment in which a cyclic model walks: along a curve through points, to a point, or for some seconds. Without any of the three it goes where the next segment begins. */
        Walk: {
            /**
             * @description discriminator enum property added by openapi-typescript
             * @enum {string}
             */
            kind: "walk";
            /**
             * @description Name of a cyclic model that travels.
             * @example cmu_walk
             */
            model: string;
            /**
             * @description Points of the world that a smooth curve from the current place leads through.
             * @default null
             */
            along: components["schemas"]["FloorPoint"][] | null;
            /**
             * @description Point of the world to walk to.
             * @default null
             */
            to: components["schemas"]["FloorPoint"] | null;
            /**
             * @description Duration in seconds, straight ahead or with `turn`.
             * @default null
             */
            seconds: number | null;
            speed?: components["schemas"]["Speed"];
            /**
             * @description What a curve of speeds runs over: metres or seconds from the start of the segment.
             * @default distance
             * @enum {string}
             */
            speed_over: "distance" | "time";
            turn?: components["schemas"]["Turn"];
            /**
             * @description Heading in radians, positive to the left of +Z, that the body keeps on its way `to` a point: on steps to the side or backwards, or on the spot if it is there, which are synthesised. From standing to standing, at 0.1 to 0.6 m/s, by default at 0.4.
             * @default null
             */
            facing: number | null;
            controls?: components["schemas"]["GivenControls"];
            /**
             * @description Name of a captured performer.
             * @default null
             */
            performer: string | null;
            labels?: components["schemas"]["Labels"];
            start?: components["schemas"]["GaitEnd"];
            stop?: components["schemas"]["GaitEnd"];
            join?: components["schemas"]["Join"];
        };
        /** @description Segment in which a model without cycle moves once. It takes place where the segment before it ends; after a walk without an end of its own, where `at` or its first target in the world is met. */
        Act: {
            /**
             * @description discriminator enum property added by openapi-typescript
             * @enum {string}
             */
            kind: "act";
            /**
             * @description Name of a model without cycle.
             * @example hdm05_grab_high
             */
            model: string;
            controls?: components["schemas"]["GivenControls"];
            /**
             * @description Name of a captured performer.
             * @default null
             */
            performer: string | null;
            labels?: components["schemas"]["Labels"];
            exact?: components["schemas"]["Exact"];
            /** @default [] */
            targets: components["schemas"]["PlacedTarget"][];
            /**
             * @description Point of the floor at which the root of its first pose is.
             * @default null
             */
            at: components["schemas"]["FloorPoint"] | null;
            /**
             * @description Heading of its first pose in radians, positive to the left of +Z.
             * @default null
             */
            facing: number | null;
            join?: components["schemas"]["Join"];
        };
        /** @description Segment in which the character stays as it is, with small movements of balance. After an act whose model has an event, such as the grasp of a reach, the act stops at its event. */
        Hold: {
            /**
             * @description discriminator enum property added by openapi-typescript
             * @enum {string}
             */
            kind: "hold";
            /** @description Duration in seconds. */
            seconds: number;
            /**
             * @description Joint that stays where it is, such as a hand that holds something.
             * @default null
             */
            joint: string | null;
            /**
             * @description Point of the world in metres that the head turns to.
             * @default null
             */
            look_at: number[] | null;
        };
        Segment: components["schemas"]["Walk"] | components["schemas"]["Act"] | components["schemas"]["Hold"];
        /** @description Model, performer and controls whose bones the character has. By default those of the first act, and of the first walk without any: acts meet their targets with their own bones. */
        CharacterChoice: {
            model: string;
            /** @default null */
            performer: string | null;
            labels?: components["schemas"]["Labels"];
            controls?: components["schemas"]["GivenControls"];
        };
        /** @description Pose of the character. */
        GivenPose: {
            /** @description Unit quaternion w x y z of each joint, local to the parent. */
            rotations: components["schemas"]["Quaternion"][];
            root_position: components["schemas"]["Vector"];
        };
        /** @description Place and heading at which a performance begins, or the last poses of the motion that it continues. */
        PerformanceStart: {
            position?: components["schemas"]["FloorPoint"];
            /**
             * @description In radians, positive to the left of +Z.
             * @default 0
             */
            heading: number;
            /**
             * @description Last frames of a motion before, at the frame rate of the script, such as those of an earlier performance; two or more keep its velocity. The performance begins with the last one.
             * @default []
             */
            poses: components["schemas"]["GivenPose"][];
        };
        /** @description Disc on the floor that no path of a walk may touch. */
        Obstacle: {
            position: components["schemas"]["FloorPoint"];
            /** @description In metres. */
            radius: number;
        };
        /**
         * @description Script of a performance, and how it is written.
         * @example {
         *       "segments": [
         *         {
         *           "kind": "walk",
         *           "model": "cmu_walk",
         *           "along": [
         *             [
         *               0,
         *               2
         *             ],
         *             [
         *               1,
         *               5
         *             ]
         *           ],
         *           "speed": 1.2
         *         }
         *       ]
         *     }
         */
        PerformanceQuestion: {
            /**
             * @example [
             *       {
             *         "kind": "walk",
             *         "model": "cmu_walk",
             *         "seconds": 2
             *       }
             *     ]
             */
            segments: components["schemas"]["Segment"][];
            /** @default null */
            character: components["schemas"]["CharacterChoice"] | null;
            start?: components["schemas"]["PerformanceStart"];
            /** @default [] */
            obstacles: components["schemas"]["Obstacle"][];
            /**
             * @description Frame rate in frames a second.
             * @default 30
             */
            fps: number;
            take?: components["schemas"]["Take"];
            variety?: components["schemas"]["Variety"];
            detail?: components["schemas"]["Detail"];
            level?: components["schemas"]["LevelNumber"];
            /**
             * @description Whether feet stand where they contact the ground.
             * @default stand
             * @enum {string}
             */
            feet: "stand" | "as_predicted";
            extrapolate?: components["schemas"]["Extrapolate"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["PerformanceRoot"];
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
            body?: components["schemas"]["Body"];
        };
        /** @description A PerformanceQuestion with the name of its file. */
        NamedScript: {
            /**
             * @description File name without extension, unique without regard to case. Null: `performance-` and the index of the script, six digits from 000000.
             * @default null
             * @example left
             */
            name: string | null;
            /**
             * @example [
             *       {
             *         "kind": "walk",
             *         "model": "cmu_walk",
             *         "seconds": 2
             *       }
             *     ]
             */
            segments: components["schemas"]["Segment"][];
            /** @default null */
            character: components["schemas"]["CharacterChoice"] | null;
            start?: components["schemas"]["PerformanceStart"];
            /** @default [] */
            obstacles: components["schemas"]["Obstacle"][];
            /**
             * @description Frame rate in frames a second.
             * @default 30
             */
            fps: number;
            take?: components["schemas"]["Take"];
            variety?: components["schemas"]["Variety"];
            detail?: components["schemas"]["Detail"];
            level?: components["schemas"]["LevelNumber"];
            /**
             * @description Whether feet stand where they contact the ground.
             * @default stand
             * @enum {string}
             */
            feet: "stand" | "as_predicted";
            extrapolate?: components["schemas"]["Extrapolate"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["PerformanceRoot"];
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
            body?: components["schemas"]["Body"];
        };
        /** @description Request for many performances in one format. All scripts are planned before the response begins; one that cannot be performed refuses the whole request. */
        PerformancesQuestion: {
            /**
             * @description File format of all performances, as a file extension.
             * @enum {string}
             */
            format: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "vrma" | "npz" | "arrow" | "msgpack";
            layout?: components["schemas"]["PerformanceLayout"];
            character?: components["schemas"]["CharacterName"];
            scripts: components["schemas"]["NamedScript"][];
        };
        /** @description One performance of an archive, with its report. */
        PerformanceEntry: {
            name: string;
            /** @description Path in the archive. */
            file: string;
            bytes: number;
            /** @description SHA-256 of the file's content. */
            sha256: string;
            /** @description Models of the script, in order. */
            models: components["schemas"]["Identity"][];
            character: components["schemas"]["Identity"];
            /** @description In seconds. */
            duration: number;
            stretch?: components["schemas"]["Stretch"];
            frames: number;
            /** @description Expected distance from captured motion in metres, root mean square over joints and frames. */
            sigma: number;
            /** @description True if clips with similar controls were captured for every segment. */
            supported: boolean;
            segments: components["schemas"]["SegmentReport"][];
            joins: components["schemas"]["JoinReport"][];
            feet?: components["schemas"]["FeetResult"];
            warnings: components["schemas"]["ScriptWarning"][];
            retargeting?: components["schemas"]["Retargeting"];
        };
        /**
         * @description One animation of the whole performance, or besides it one of each segment.
         * @default whole
         * @enum {string}
         */
        PerformanceLayout: "whole" | "segments";
        /** @description A performance with its report; with `plan=true` the report alone. */
        PerformanceDocument: {
            trust: components["schemas"]["PerformanceReport"];
            /** @description Units of the numbers. By default lengths are in metres and Y is up. */
            units?: {
                [key: string]: string;
            };
            /** @description Names of the joints. */
            names?: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents?: number[];
            /** @description Frame rate in frames a second. */
            rate?: number;
            frames?: number;
            /** @description Time of each frame, in seconds from the first frame. */
            times?: number[];
            rotations?: components["schemas"]["Rotations"];
            root_position?: components["schemas"]["RootPosition"];
            bone_offsets?: components["schemas"]["BoneOffsets"];
        };
        /** @description Timeline, joins, contacts and warnings of a performance. */
        PerformanceReport: {
            /** @description Models of the script, in order. */
            models: components["schemas"]["Identity"][];
            character: components["schemas"]["Identity"];
            /** @description In seconds. */
            duration: number;
            stretch?: components["schemas"]["Stretch"];
            frames: number;
            /** @description Expected distance from captured motion in metres, root mean square over joints and frames. */
            sigma: number;
            /** @description True if clips with similar controls were captured for every segment. */
            supported: boolean;
            segments: components["schemas"]["SegmentReport"][];
            joins: components["schemas"]["JoinReport"][];
            feet?: components["schemas"]["FeetResult"];
            warnings: components["schemas"]["ScriptWarning"][];
            retargeting?: components["schemas"]["Retargeting"];
        };
        /** @description A segment in the time of the performance. */
        SegmentReport: {
            /** @description walk, act or hold. */
            kind: string;
            /** @description Identity of its model; that of the act before for a hold. */
            model: string;
            /** @description In seconds. */
            begins: number;
            /** @description In seconds. */
            ends: number;
            /** @description Root on the floor where it begins, x and z in metres. */
            place: number[];
            /** @description There, in radians. */
            heading: number;
            /** @description In metres. */
            sigma: number;
            /** @description Controls where it begins. */
            controls?: {
                [key: string]: number;
            };
            /** @description Phase of the cycle at which a walk begins. */
            phase?: number;
            /** @description Time of the event of an act in seconds. */
            event?: number;
            /** @description How far the joints of the character stay from the targets of the act. */
            targets?: components["schemas"]["Met"][];
            path?: components["schemas"]["PathReport"];
            /** @description What was chosen or synthesised. */
            notes?: string[];
        };
        /** @description Deviations of a walk from its path, means over each cycle, root mean square. */
        PathReport: {
            /** @description In metres. */
            lateral: number;
            /** @description In metres. */
            along: number;
            /** @description In radians. */
            heading: number;
            /** @description In metres a second. */
            speed: number;
        };
        /** @description A join of two segments. */
        JoinReport: {
            /** @description Index of the segment that begins. */
            segment: number;
            /** @description In seconds. */
            time: number;
            /** @description Distance of the two motions at the cut in metres. */
            distance: number;
            /** @description dead, hermite or cut. */
            blend: string;
            /** @description Duration of the blend. */
            seconds: number;
            /** @description Largest acceleration near the join, mean over joints relative to the root, in metres a second squared. */
            peak: number;
            /** @description Usual largest acceleration of the motions away from the join, 99th percentile over frames, in metres a second squared. */
            usual: number;
            /** @description True if the join is unlike what the motions do; a warning says so. */
            hard: boolean;
            /** @description `captured` if `usual` is of the captured clips of the models; `synthesised` if it is of the motions without joins, since a model is of an earlier version. Since 4.2.0. */
            reference?: string;
        };
        ScriptWarning: {
            /**
             * @description JSON pointer to the cause in the script.
             * @example /segments/2/targets/0
             */
            pointer: string;
            message: string;
        };
        WhyQuestion: {
            controls: components["schemas"]["Controls"];
            nearest?: components["schemas"]["Nearest"];
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            labels?: components["schemas"]["Labels"];
        };
        /**
         * @description At any time, the poses are a weighted sum of the captured clips, in the coordinates of the
         *     model's motion tensor. The weights in `nearest` and `others` sum to one. A weight may be
         *     negative: of a clip that other clips screen, or of a clip from which the prediction
         *     extrapolates. The shares in `nearest` and `others` are never negative and sum to one.
         */
        Reasons: {
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            /** @description Requested performer; null for an unseen performer. */
            performer: string | null;
            labels?: components["schemas"]["RequestedLabels"];
            /** @description As in Trust. */
            warnings: string[];
            inferred?: components["schemas"]["Inferred"];
            support?: components["schemas"]["Backing"];
            /** @description Captured clips, the nearest first. */
            nearest: components["schemas"]["CapturedClip"][];
            /** @description Number and total weight of the clips that are not listed. */
            others: {
                count: number;
                weight: number;
                /** @description Total share of these clips. Since 3.1.0. */
                share?: number;
            };
        };
        /** @description Whether clips with similar controls were captured, and the quantities that decide it. */
        Backing: {
            supported: components["schemas"]["Supported"];
            /** @description Distance of each control beyond its sampled range, as a share of that range. */
            beyond: {
                [key: string]: number;
            };
            /** @description Largest supported value of `beyond`. */
            most_beyond: number;
            /** @description Kriging variance of a field over the controls of the captured clips: near 0 where many clips are close, near 1 far from all clips. */
            variance: number;
            /** @description Largest supported value of `variance`. */
            most_variance: number;
        };
        /** @description Points to capture, in ranked order. Each rank assumes that the points before it were captured. */
        Suggestions: {
            model: components["schemas"]["Identity"];
            /** @description Performer whose clips alone counted as captured; null if all clips counted. */
            performer: string | null;
            labels?: components["schemas"]["RequestedLabels"];
            /** @description Number of candidate points. */
            candidates: number;
            /** @description Suggested points, the most useful first. */
            suggestions: components["schemas"]["Suggestion"][];
        };
        Suggestion: {
            controls: components["schemas"]["Controls"];
            /** @description Share by which the mean of `variance` (see Backing) over the candidates falls if this point is captured. */
            gain: number;
            /** @description `variance` (see Backing) at this point before it is captured. */
            variance: number;
            /** @description Source of the nearest captured clip. */
            nearest: string;
            lacking: components["schemas"]["ControlName"];
            /** @description Difference of the nearest clip in the control `lacking`, in which it differs most, as a share of that control's range. */
            gap: number;
        };
        CapturedClip: {
            /** @description Motion file, and the frame range if the clip is a part of it. */
            source: string;
            controls: components["schemas"]["Controls"];
            /** @description Performer of the clip; null if the model does not distinguish performers. */
            performer: string | null;
            /** @description Names of the clip in the label sets besides `performer`. Absent if there are none. Since 3.1.0. */
            labels?: {
                [key: string]: string;
            };
            /** @description Distance from the requested controls in the model's metric. At distance 1 the clips are almost uncorrelated. */
            distance: number;
            /** @description Weight of the clip. */
            weight: number;
            /** @description Part of the clip in the sum of all positive weights; 0 for a negative weight. Since 3.1.0. */
            share?: number;
        };
        /**
         * @description Name of a control of the model.
         * @example turn
         */
        ControlName: string;
        /** @default 32 */
        GridSteps: number;
        /** @default 0 */
        Margin: number;
        /**
         * @description A number for each control that is not an axis. Omitted controls take the card's default.
         * @example {
         *       "stature": 1.72
         *     }
         */
        FixedControls: {
            [key: string]: number;
        };
        /** @description Request for a grid of sigma. Default limit: 65,536 points. */
        SigmaQuestion: {
            /** @description Control that varies from column to column. */
            across: components["schemas"]["ControlName"];
            /** @description Control that varies from row to row; different from `across`. */
            along: components["schemas"]["ControlName"];
            columns?: components["schemas"]["GridSteps"];
            rows?: components["schemas"]["GridSteps"];
            /** @description Margin of the grid beyond the sampled range on either side, as a share of that range. */
            margin?: components["schemas"]["Margin"];
            controls?: components["schemas"]["FixedControls"];
            performer?: components["schemas"]["Performer"];
            labels?: components["schemas"]["Labels"];
        };
        /** @description Sigma and support over all values of two controls. */
        SigmaGrid: {
            model: components["schemas"]["Identity"];
            across: components["schemas"]["ControlName"];
            along: components["schemas"]["ControlName"];
            /** @description Values of the other controls. */
            controls: {
                [key: string]: number;
            };
            /** @description Requested performer; null for an unseen performer. */
            performer: string | null;
            labels?: components["schemas"]["RequestedLabels"];
            units: {
                [key: string]: string;
            };
            /** @description Value of `across` for each column. */
            across_values: number[];
            /** @description Value of `along` for each row. */
            along_values: number[];
            /** @description Sigma as in Trust, in metres, for each row and column. */
            sigma: number[][];
            /** @description For each row and column, whether all controls lie in their sampled ranges. */
            inside: boolean[][];
            /** @description For each row and column, `supported` as in Trust. Always present since 2.2.0. */
            supported?: boolean[][];
        };
        /** @description Request for many clips in one format. All clips are validated before the response begins; one invalid clip refuses the whole request. */
        ClipsQuestion: {
            /**
             * @description File format of all clips, as a file extension.
             * @enum {string}
             */
            format: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "vrma" | "npz" | "arrow" | "msgpack";
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
            body?: components["schemas"]["Body"];
            character?: components["schemas"]["CharacterName"];
            clips: components["schemas"]["NamedClipQuestion"][];
        };
        /** @description A ClipQuestion with the name of its file. */
        NamedClipQuestion: {
            /**
             * @description File name without extension, unique without regard to case. Null: `clip-` and the index of the clip, six digits from 000000.
             * @default null
             * @example left
             */
            name: string | null;
            controls: components["schemas"]["Controls"];
            /**
             * @description Frame rate in frames a second.
             * @default 30
             */
            fps: number;
            /**
             * @description Time of the first frame in seconds.
             * @default 0
             */
            start: number;
            /**
             * @description Latest time of the last frame in seconds; null for the clip's duration.
             * @default null
             */
            end: number | null;
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            labels?: components["schemas"]["Labels"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["Root"];
            loop?: components["schemas"]["Loop"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            feet?: components["schemas"]["FeetMode"];
            floor?: components["schemas"]["FloorValue"];
            limits?: components["schemas"]["Limits"];
            take?: components["schemas"]["Take"];
            variety?: components["schemas"]["Variety"];
            detail?: components["schemas"]["Detail"];
        };
        /** @description One clip of an archive, with its uncertainty. */
        ManifestEntry: {
            name: string;
            /** @description Path in the archive. */
            file: string;
            bytes: number;
            /** @description SHA-256 of the file's content. */
            sha256: string;
            frames: number;
            fps: number;
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            performer: string | null;
            labels?: components["schemas"]["RequestedLabels"];
            take?: components["schemas"]["TakeFacts"];
            level: number;
            /** @description As in Trust, in seconds. */
            duration: number;
            stretch?: components["schemas"]["Stretch"];
            /** @description As in Trust, in metres. */
            sigma: number;
            band?: components["schemas"]["Band"];
            /** @description As in Trust. */
            deviations?: components["schemas"]["Deviation"][];
            supported?: components["schemas"]["Supported"];
            performer_seen?: components["schemas"]["PerformerSeen"];
            joint_sigma?: components["schemas"]["SigmaByJoint"];
            warnings: string[];
            inferred?: components["schemas"]["Inferred"];
            /** @description As in Trust. */
            measured?: {
                [key: string]: number;
            };
            /** @description As in Trust. */
            targets?: components["schemas"]["Met"][];
            retargeting?: components["schemas"]["Retargeting"];
            /** @description As in Trust. */
            limits?: components["schemas"]["BrokenLimit"][];
        };
        /** @description The take of a response; absent if it is the prediction. Since 3.3.0. */
        TakeFacts: {
            seed: number;
            variety: number;
            /** @description Whether details that no control predicts were sampled. */
            detail: boolean;
        };
        /** @description Largest distance in time of a moment of the motion from its frame, in seconds: frames lie on targets, on the event, and on the end of a motion that has one of them and is no cycle; a loop has whole steps. At most half a frame. Absent for frames at equal times. Since 5.1.0. */
        Stretch: number;
        /** @description Report on the motion of a user's character. Absent for the character of the model. Since 4.3.0. */
        Retargeting: {
            /** @description Name of the character. */
            character: string;
            /** @description Name of its file. */
            file: string;
            /** @description Roles of the motion that the character follows. */
            mapped: string[];
            /** @description Roles of the motion that the character lacks. */
            missing: string[];
            /** @description Length of its legs over that of the motion's. */
            scale: number;
            /** @description Foot skate of the motion in proportion to the legs, in metres a second. */
            skate_source: number;
            /** @description Foot skate of its copied orientations, in metres a second. */
            skate_copied: number;
            /** @description Foot skate of the result, in metres a second. */
            skate: number;
            /** @description Mean angle between the bones of the legs as copied and as given, in radians. */
            legs_turned: number;
            /** @description Largest distance by which the pelvis was lowered so that the legs reach, in metres. */
            lowered: number;
            /** @description 99th percentile of the depth of soles below the floor, in metres. */
            penetration: number;
            /** @description Largest distance of each hand from its target while that is held, in metres. */
            hands_missed: number[];
        };
        /** @description Characters of users, and files that cannot be used. */
        CharacterList: {
            characters: components["schemas"]["UserCharacter"][];
            faults: components["schemas"]["CharacterFault"][];
        };
        /** @description Character of a user's file. */
        UserCharacter: {
            /** @description Name of the character, for the parameter `character`. */
            name: string;
            /** @description Name of its file. */
            file: string;
            /** @description USD or glTF. */
            format: string;
            /** @description SHA-256 of the rig, its file and stated roles. */
            digest: string;
            /** @description Number of joints. */
            joints: number;
            /** @description Height of its joints at rest, in metres. */
            height: number;
            roles: components["schemas"]["JointRole"][];
            /** @description One sentence for each thing that was assumed or left out. */
            warnings: string[];
        };
        /** @description Role of a joint of a character. */
        JointRole: {
            /** @description Such as leftUpperLeg. */
            role: string;
            /** @description Name of the joint. */
            joint: string;
            /** @description 1 for a role that was stated. */
            confidence: number;
        };
        /** @description File that cannot be used as a character. */
        CharacterFault: {
            file: string;
            /** @description In words. */
            reason: string;
        };
        /** @description Provenance and uncertainty of a response. */
        Trust: {
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            /** @description Requested performer; null for an unseen performer. */
            performer: string | null;
            labels?: components["schemas"]["RequestedLabels"];
            take?: components["schemas"]["TakeFacts"];
            /** @description Level of detail, an index into the card's levels; 0 is the finest. */
            level: number;
            /** @description Duration of the whole clip at these controls, in seconds: of a clip that ends on a frame, that of its frames. */
            duration: number;
            stretch?: components["schemas"]["Stretch"];
            /** @description Expected distance of a captured clip at these controls from this clip, root mean square over joints and frames, in metres. */
            sigma: number;
            band?: components["schemas"]["Band"];
            supported?: components["schemas"]["Supported"];
            performer_seen?: components["schemas"]["PerformerSeen"];
            joint_sigma?: components["schemas"]["SigmaByJoint"];
            /** @description One sentence for each control outside its sampled range, or one sentence if the controls lie in a gap between the samples, one for each element of `deviations` and of `limits`, and one for each target that is not reached. */
            warnings: string[];
            /** @description Requested controls whose value the motion does not have. Absent if there is none. Since 3.1.0. */
            deviations?: components["schemas"]["Deviation"][];
            inferred?: components["schemas"]["Inferred"];
            /** @description Values of the measurable controls on this motion, in their units. Present for clips, and for poses with constraints. */
            measured?: {
                [key: string]: number;
            };
            /** @description Measured controls and targets that constrained the motion, each with its remaining distance. Absent without constraints. */
            targets?: components["schemas"]["Met"][];
            /** @description Feet that were made to stand. Absent for feet as predicted. Since 4.0.0. */
            feet?: components["schemas"]["FeetResult"];
            retargeting?: components["schemas"]["Retargeting"];
            /** @description Joints of a robot that turn beyond their limits in a clip. Absent if there is none. Since 5.2.0. */
            limits?: components["schemas"]["BrokenLimit"][];
        };
        /** @description Feet that were made to stand, over the whole motion. */
        FeetResult: {
            /** @description Stances of all feet. Empty where no foot can be placed. */
            stances: components["schemas"]["Stance"][];
            /** @description Number of swings. */
            swings: number;
            /** @description Foot skate of the prediction, in metres a second. */
            skate_before: number;
            /** @description Foot skate of the motion, in metres a second. */
            skate: number;
            /** @description Largest distance over the floor of a standing foot from its place, in metres. */
            drift: number;
            /** @description Largest distance by which the pelvis was lowered so that the legs reach, in metres. */
            lowered: number;
            /** @description Distance by which the whole character was lowered to the floor, in metres; negative if it was raised. */
            grounded: number;
            /** @description One sentence for each foot that is as predicted, or does not reach its floor. */
            left: string[];
            /** @description Floor on which the feet stand. Absent for a floor at height 0. */
            floor?: components["schemas"]["Floor"];
        };
        /** @description Interval in which a foot stands. */
        Stance: {
            /** @description Joint that contacts the ground. */
            joint: string;
            /** @description Time from the start of the whole clip, in seconds. */
            begin: number;
            /** @description Time from the start of the whole clip, in seconds; in a cycle it may lie in the next one. */
            end: number;
            /** @description Position of the joint before the root's travel is removed, in metres. */
            position: number[];
        };
        /**
         * @description Range of `sigma`, on one scale for all models: `close` up to 3 cm, `near` up to 7.5 cm,
         *     `rough` up to 15 cm, and `guess` beyond. Other words may follow. Since 3.1.0.
         * @example near
         */
        Band: string;
        /** @description A requested control whose value the motion does not have. */
        Deviation: {
            control: components["schemas"]["ControlName"];
            /** @description Requested value. */
            asked: number;
            /** @description Value measured on the motion; for a control that is not measured, the value as which it acts. */
            given: number;
            /** @description Unit of the values. */
            unit: string;
            /** @description Smallest and largest sampled value. */
            captured: number[];
            /**
             * @description Side of the given value, seen from the requested one: above or below.
             * @example below
             */
            side: string;
        };
        /**
         * @description Names of the omitted controls, which are set to those of a typical captured clip near the
         *     other controls and the targets (their conditional mean before 3.1.0). Absent if no control was omitted. Since 2.2.0.
         */
        Inferred: string[];
        /** @description True if clips with similar controls were captured: no control lies more than a tenth of its range outside that range, and captured clips are as near as 19 of 20 captured clips are to the others. Always present since 2.2.0. */
        Supported: boolean;
        /** @description Sigma of each joint of the card, in metres. Absent unless requested. */
        SigmaByJoint: number[];
        /** @description The `labels` of the request. Absent if there are none. Since 3.1.0. */
        RequestedLabels: {
            [key: string]: components["schemas"]["Label"];
        };
        /** @description True if the request names a captured performer. Absent if the model does not distinguish performers. */
        PerformerSeen: boolean;
        /** @description Residual of one constraint. */
        Met: {
            /**
             * @description Name of a control, or joint and moment of a target.
             * @example RightHand at end
             */
            what: string;
            /** @description Distance of the motion from the constraint, in `unit`. */
            miss: number;
            /** @description Unit of `miss`: m, m/s or deg. */
            unit: string;
            /** @description True if the residual is at most 0.001 of the unit, which is 1 mm for lengths. */
            reached: boolean;
        };
        /** @description Unit quaternion w x y z for each time and joint, local to the parent. */
        Rotations: components["schemas"]["Quaternion"][][];
        /** @description Position of the root for each time, in metres. */
        RootPosition: components["schemas"]["Vector"][];
        /** @description Translation of each joint from its parent at these controls, in metres. The entry of the root is not used. */
        BoneOffsets: components["schemas"]["Vector"][];
        /** @description Value of each curve at each time, within the limits on the card. Absent for models without curves. */
        CurveValues: number[][];
        /** @description Scalar channel of a model's motions, such as the weight of a blend shape. */
        Curve: {
            name: string;
            /** @description Smallest value of the answers. */
            minimum: number;
            /** @description Largest value of the answers. */
            maximum: number;
            /** @description Distance of a joint that one unit of the curve counts as in sigma and in errors of levels, in metres. */
            distance: number;
        };
        /** @description Poses of the joints of the model's card, in its order. */
        PoseAnswer: {
            trust: components["schemas"]["Trust"];
            /** @description Requested times in seconds. */
            times: number[];
            rotations: components["schemas"]["Rotations"];
            root_position: components["schemas"]["RootPosition"];
            bone_offsets: components["schemas"]["BoneOffsets"];
            curves?: components["schemas"]["CurveValues"];
        };
        /** @description A clip with its skeleton. */
        ClipDocument: {
            trust: components["schemas"]["Trust"];
            /** @description Units of the numbers. By default lengths are in metres and Y is up. */
            units: {
                [key: string]: string;
            };
            /** @description Names of the joints. */
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            /** @description Frame rate in frames a second. */
            rate: number;
            frames: number;
            /** @description Time of each frame, in seconds from the first frame. */
            times: number[];
            rotations: components["schemas"]["Rotations"];
            root_position: components["schemas"]["RootPosition"];
            bone_offsets: components["schemas"]["BoneOffsets"];
            /** @description Names of the curves. Absent for models without curves. */
            curve_names?: string[];
            curves?: components["schemas"]["CurveValues"];
        };
        Quaternion: number[];
        Vector: number[];
        /** @description One control parameter, its unit and its sampled range. */
        Control: {
            name: string;
            unit: string;
            description: string;
            minimum: number;
            maximum: number;
            /** @description Value in the medoid clip, so that the defaults of all controls are those of one captured clip (since 3.1.0; before, the median of the sampled values). */
            default: number;
            /** @description Distinct sampled values if there are few, else empty. */
            values: number[];
            measure?: components["schemas"]["Measure"];
        };
        /** @description Definition of a control that is measured on a motion. Absent for a control whose values were entered in the training table. Since 2.2.0. */
        Measure: {
            /**
             * @description `left`, `height` and `forward` are coordinates of a joint at a moment, in metres; the
             *     origin is the first pose's root on the floor, and the axes follow its heading.
             *     `step_length` is the greatest distance of one foot ahead of the other, in metres.
             *     `stride_length` (m), `speed` (m/s) and `turn` (degrees to the left) are of a whole
             *     cycle. `forward_velocity`, `left_velocity` (m/s) and `turn_rate` (rad/s to the left) are
             *     the constant velocities, in the frame that turns with the body, that cover the travel of
             *     a cycle. `leg_length` and `stature` (m) are of the performer's bones and independent of
             *     the motion.
             * @enum {string}
             */
            quantity: "left" | "height" | "forward" | "step_length" | "stride_length" | "speed" | "turn" | "left_velocity" | "forward_velocity" | "turn_rate" | "leg_length" | "stature";
            /** @description Indices of the joints whose mean position is measured, of the two feet of a step, or of the bones of a leg. */
            joints?: number[];
            /**
             * @description Moment of a position; `farthest` is from the root.
             * @enum {string}
             */
            at?: "start" | "end" | "highest" | "lowest" | "farthest" | "landmark";
            /** @description Mean time of the landmark over the captured clips, as a share of the duration. */
            share?: number;
        };
        /** @description Joints in an order with parents first, their rest offsets, and the end sites without a joint. At rest every rotation is the identity. */
        Skeleton: {
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            /** @description Offsets from the parent, in metres. */
            offsets: components["schemas"]["Vector"][];
            /** @description Index of the joint of each end site. */
            tip_joints: number[];
            /** @description Offsets of the end sites from their joints, in metres. */
            tip_offsets: components["schemas"]["Vector"][];
        };
        /** @description A level of detail. Errors are distances in metres between its joints and those of the untruncated model, over random controls, performers and times. */
        Level: {
            /** @description Ranks of the core tensor: degrees of freedom, frames and samples. */
            ranks: number[];
            /** @description Number of captured clips that the level evaluates. */
            samples: number;
            /** @description Indices of the joints that move. The others keep the family's mean rotation. */
            joints: number[];
            /** @description Count of the numbers in the file that the level reads. */
            numbers: number;
            /** @description Size of `numbers` in float32, in bytes. */
            bytes: number;
            /** @description Multiply-add operations per pose. */
            operations: number;
            /** @description Root mean square error, in metres. */
            rms: number;
            /** @description 99th percentile of the error, in metres. */
            p99: number;
            /** @description Largest root mean square error over the joints of one pose, in metres; the selection of levels uses it. */
            pose: number;
            max: number;
            /** @description Root mean square error of the event's joint at its event, in metres; null without an event. */
            effector: number | null;
            /** @description Number of leading coefficients that have a second prediction for the time around the event; 0 without one. */
            event?: number;
        };
        /** @description Description of a model for clients, without its weights. */
        ModelCard: {
            identity: components["schemas"]["Identity"];
            /** @description Name in the training recipe. */
            name: string;
            description: string;
            controls: components["schemas"]["Control"][];
            skeleton: components["schemas"]["Skeleton"];
            units: {
                [key: string]: string;
            };
            /** @description Whether the last pose leads into the first. */
            cyclic: boolean;
            /**
             * @description Whether the root travels or stays in place.
             * @enum {string}
             */
            root: "travelling" | "in_place";
            /** @description Frame rate of the captured clips, frames a second. */
            rate: number;
            /** @description Number of frames of the motion tensor. */
            frames: number;
            /** @description Number of clips in the motion tensor: the captured ones, or the inducing ones of a family of 300 clips or more, all of whose clips `provenance.clips` counts. */
            samples: number;
            /** @description Levels of detail, the finest first. */
            levels: components["schemas"]["Level"][];
            /** @description Durations of the shortest and the longest captured clip, in seconds. */
            durations: number[];
            /** @description Label sets of the captured clips, such as performers and styles, in the order of the weights that the graph takes. Since 3.1.0. */
            labels: components["schemas"]["LabelSet"][];
            /** @description Names of the performers that a request may name; empty if the model does not distinguish performers. */
            performers: string[];
            /** @description Control values of each clip of `samples`. */
            examples: number[][];
            /** @description Performer of each clip of `samples`, as an index into `performers`; empty if the model does not distinguish performers. */
            moved_by: number[];
            /** @description Indices of the joints that stand on the ground; empty if the recipe names none. */
            feet: number[];
            /** @description Measurements of the training. `detail` is of the details of a cycle that are sampled, not predicted: its harmonics and directions, and the acceleration of left-out predictions over that of captured clips, without it (`acceleration`) and with it (`sampled`). */
            diagnostics: Record<string, never>;
            /** @description Recipe, hashes of the data, versions, licence. */
            provenance: Record<string, never>;
            /** @description Joints by role, with the bone names of a VRM humanoid as roles; empty if the recipe names none. */
            roles: {
                [key: string]: string;
            };
            /** @description File and frames of each clip of `samples`. */
            sources: string[];
            /** @description Error of each joint as a share of sigma. */
            joint_sigma?: number[];
            /** @description Parameters of the kriging model that weights the captured clips. */
            kriging: {
                /** @enum {string} */
                covariance: "exponential" | "gaussian" | "spherical" | "matern32" | "matern52";
                /** @description Degrees of the drifts; their predictions are averaged. */
                drifts: (0 | 1)[];
                /** @description Distance of half the sampled range in the model's metric, for each control. */
                scales: number[];
                /** @description Nugget as a share of the sill. */
                nugget: number;
                /** @description Variance of the slope along each control, in sills per squared half-range. */
                trend: number;
                /** @description Parameters of each of `labels` on the card, in its order. */
                labels: components["schemas"]["LabelKernel"][];
            };
            /** @description Leave-one-out error of each captured clip: its distance from the prediction of the other clips, root mean square over joints and frames, in metres. */
            left_out?: number[];
            /** @description Main event of the motion; null if the recipe names none. */
            event?: {
                /** @description Index of the event's joint. */
                joint: number;
                /** @description Mean time of the event over the captured clips, as a share of the duration. */
                share: number;
            } | null;
            /** @description Points of the controls that the recipe names, such as stroll and hurry; empty if it names none. */
            presets?: components["schemas"]["Preset"][];
            /** @description Curves of the answers, in their order. Absent for models without curves. */
            curves?: components["schemas"]["Curve"][];
            /** @description Joints whose contacts with the ground, or with a thing, the model predicts. Absent for models without contacts. */
            contacts?: components["schemas"]["FootContact"][];
            /** @description Accelerations of the joints relative to the root in the captured clips, mean over the joints, at 60 frames a second, in metres a second squared. Joins of performances are compared with them. Absent for models of earlier versions. Since 4.2.0. */
            captured_acceleration?: {
                /** @description Median over the frames of all clips. */
                median: number;
                /** @description 99th percentile over the frames of all clips. */
                p99: number;
            };
        };
        /** @description Joint with contacts, and its swings between them in the captured clips. */
        FootContact: {
            /** @description Index of the joint. */
            joint: number;
            /** @description Median height of the joint in contact, in metres. */
            height: number;
            /** @description Median duration of a swing, in seconds. */
            swing: number;
            /** @description 90th percentile of the durations of swings, in seconds. */
            longest_swing: number;
            /** @description Height by which the joint is lifted in a swing, 75th percentile, in metres. */
            clearance: number;
        };
        /** @description Names by which clips differ besides their controls. */
        LabelSet: {
            /** @description Name of the set; performer for the people who move. */
            name: string;
            /** @description Names that a request may give, in the order of their weights. */
            names: string[];
            /** @description Name of each captured clip, as an index into `names`. */
            clips: number[];
        };
        LabelKernel: {
            /** @description Number of names in the label set. */
            count: number;
            /** @description Correlation of the motions of two names, beside their offsets. */
            correlation: number;
            /** @description Variance of a name's own offset, in sills. */
            offset: number;
        };
        /** @description Named point of the controls, within the sampled ranges. */
        Preset: {
            name: string;
            /** @description A value for each control. */
            controls: {
                [key: string]: number;
            };
            /** @description Performer of the motion; null for an unseen performer. */
            performer: string | null;
            /** @description Names of the motion in label sets besides `performer`. Since 3.1.0. */
            labels?: {
                [key: string]: string;
            };
        };
        /** @description A number for each character, or one number for all. */
        Column: number | number[];
        /** @description Position x y z from the origin, in metres. */
        Place: number[];
        /**
         * @description Position and lens of a camera. It has no direction: a character behind it counts by its
         *     distance like any other, because a mirror or a shadow may show it. The camera must not be
         *     inside a character.
         * @example {
         *       "position": [
         *         0,
         *         1.7,
         *         -12
         *       ],
         *       "fov": 0.9,
         *       "height": 1080
         *     }
         */
        Camera: {
            position: components["schemas"]["Place"];
            /** @description Vertical field of view in radians. */
            fov: number;
            /** @description Height of the image in pixels. */
            height: number;
        };
        /**
         * @description Places of one person over time, as columns of equal lengths.
         * @example {
         *       "id": "anna",
         *       "times": [
         *         0,
         *         1,
         *         2
         *       ],
         *       "positions": [
         *         [
         *           0,
         *           0
         *         ],
         *         [
         *           1.2,
         *           0
         *         ],
         *         [
         *           2.4,
         *           0.1
         *         ]
         *       ],
         *       "headings": [
         *         0,
         *         0,
         *         0.1
         *       ]
         *     }
         */
        Track: {
            /** @description Id of the person, from which height, labels and take follow. */
            id: string;
            /** @description Times in seconds, ascending. */
            times: number[];
            /** @description East and north, in metres: in USD, X and -Z. */
            positions: number[][];
            /**
             * @description Angles from east against the clock in radians; null for the way of travel.
             * @default null
             */
            headings: number[] | null;
        };
        /**
         * @description Request for people who follow tracks. The world is that of simulators: x east, y north. The
         *     clock begins at the first sample of all. A track that cannot be walked (times that do not
         *     ascend, jumps, places more than 100 km from the origin) is an error with a pointer to its sample.
         * @example {
         *       "tracks": [
         *         {
         *           "id": "anna",
         *           "times": [
         *             0,
         *             1,
         *             2
         *           ],
         *           "positions": [
         *             [
         *               0,
         *               0
         *             ],
         *             [
         *               1.2,
         *               0
         *             ],
         *             [
         *               2.4,
         *               0.1
         *             ]
         *           ]
         *         }
         *       ]
         *     }
         */
        TracksQuestion: {
            /** @description Tracks, one for each person. */
            tracks: components["schemas"]["Track"][];
            /**
             * @description Whether people with unusable tracks are left out, and told in warnings.
             * @default false
             */
            skip_bad: boolean;
            /**
             * @description Frame rate in frames a second.
             * @default 30
             */
            fps: number;
            /**
             * @description Seed of all random numbers.
             * @default 0
             */
            seed: number;
            labels?: components["schemas"]["Labels"];
            /**
             * @description Level of detail; null for the finest.
             * @default null
             */
            level: number | null;
            /**
             * @description Whether feet stand where they contact the ground.
             * @default null
             * @enum {string|null}
             */
            feet: "stand" | "as_predicted" | null;
            /**
             * @description Seed of another take; with `index` each id has its own.
             * @default 0
             */
            take: number | "index";
            /**
             * @description Size of the deviations of takes.
             * @default 0.7
             */
            variety: number;
            /**
             * @description Whether details are added, sampled by the takes.
             * @default false
             */
            detail: boolean;
            /**
             * @description Sharing of data in USD; other formats refuse it.
             * @default references
             * @enum {string}
             */
            instancing: "references" | "scenegraph" | "flatten";
            /**
             * @description Body in USD; other formats refuse it.
             * @default null
             * @enum {string|null}
             */
            body: "none" | "mannequin" | "bones" | null;
        };
        /**
         * @description Request for one pose of each of many characters. All lists have the same length, the number
         *     of characters, and the same order. A scalar applies to all characters. Without a list there
         *     is one character. The poses are the model's predictions; constraints do not apply to crowds.
         */
        CrowdQuestion: {
            /**
             * @description Values of each control of the model, in the control's unit. All controls are required.
             * @example {
             *       "stature": [
             *         1.72,
             *         1.8
             *       ],
             *       "hip_height": 0.9,
             *       "turn": [
             *         20,
             *         0
             *       ],
             *       "target_height": 1.1
             *     }
             */
            controls: {
                [key: string]: components["schemas"]["Column"];
            };
            /**
             * @description Time of each character, in seconds from the start of its clip, at most its duration. Durations differ slightly between levels: a time after the end by at most a tenth of the duration is set to the end, except at level 0 if the request gives the level as a number and no `from_level`.
             * @example [
             *       0,
             *       0.5
             *     ]
             */
            time: components["schemas"]["Column"];
            /**
             * @description Position of each character's own frame; null for the origin.
             * @default null
             * @example [
             *       [
             *         0,
             *         0,
             *         0
             *       ],
             *       [
             *         1.5,
             *         0,
             *         2
             *       ]
             *     ]
             */
            position: components["schemas"]["Place"][] | null;
            /**
             * @description Rotation of each character about +Y in radians. At a quarter turn, a character that faces +Z in its own frame faces +X.
             * @default 0
             */
            heading: components["schemas"]["Column"];
            /**
             * @description Performer of each character, one of `performers` on the model's card; null for an unseen performer.
             * @default null
             */
            performer: (string | null) | (string | null)[];
            /**
             * @description Label of each character by label set, one of `labels` on the model's card; null where the set is left open. Since 3.1.0.
             * @default {}
             */
            labels: {
                [key: string]: components["schemas"]["Label"] | (components["schemas"]["Label"] | null)[];
            };
            /**
             * @description Level of detail of each character, or `auto`: the coarsest level whose error covers at
             *     most `pixels` pixels of the `camera`, or the finest level if all errors are larger.
             * @default 0
             */
            level: components["schemas"]["LevelNumber"] | components["schemas"]["LevelNumber"][] | "auto";
            /**
             * @description With `auto`, the levels of the previous response. A character then changes to a coarser
             *     level only if the error is a fifth below the limit. This prevents flicker while the
             *     camera trembles.
             * @default null
             */
            previous_level: components["schemas"]["LevelNumber"][] | null;
            /**
             * @description Levels from which characters are in transition. Their poses are blended with those of
             *     their current level, so that a change of level does not pop. With `auto`, the current
             *     level of such a character stays at `previous_level` during the transition.
             * @default null
             */
            from_level: components["schemas"]["LevelNumber"][] | null;
            /**
             * @description With `from_level`, the completed share of the transition, 0 to 1.
             * @default null
             */
            blend: number | number[] | null;
            /**
             * @description Required with `auto`; an error without it.
             * @default null
             */
            camera: components["schemas"]["Camera"] | null;
            /**
             * @description With `auto`, the maximum number of pixels that an error may cover; 1 if null.
             * @default null
             */
            pixels: number | null;
            /**
             * @description With `auto`, a limit in milliseconds for the computation of all poses, by the cost of
             *     the levels. If `pixels` requires more time, the pixel limit is raised to the smallest
             *     value that fits. If the coarsest level exceeds the budget too, all characters have the
             *     coarsest level. `warnings` reports both cases.
             * @default null
             */
            budget_ms: number | null;
            /**
             * @description Whether characters walk away from their positions.
             * @default travelling
             * @enum {string}
             */
            root: "travelling" | "in_place";
            extrapolate?: components["schemas"]["Extrapolate"];
            /**
             * @description Seed of each character's take, or `index` for seeds from 1 on in the order of the
             *     characters. At most 2,000 characters may have a take. Durations and travel stay those of
             *     the prediction. Since 3.3.0.
             * @default 0
             */
            take: components["schemas"]["Take"] | components["schemas"]["Take"][] | "index";
            /**
             * @description Size of each take's deviations. Since 3.3.0.
             * @default 0.7
             */
            variety: components["schemas"]["Variety"] | components["schemas"]["Variety"][];
            detail?: components["schemas"]["Detail"];
        };
        /** @description One pose per character, in the order of the request, of the joints in `names`. */
        CrowdPoses: {
            model: components["schemas"]["Identity"];
            /** @description Names of the joints. */
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            units: {
                [key: string]: string;
            };
            /** @description Warnings about the whole crowd. */
            warnings: string[];
            /** @description Unit quaternion w x y z for each character and joint, local to the parent; that of the root is in world space. */
            rotations: components["schemas"]["Quaternion"][][];
            /** @description Position of the root of each character in world space, in metres. */
            root_position: components["schemas"]["Vector"][];
            /** @description Translation of each joint from its parent for each character, in metres. The entry of the root is not used. */
            bone_offsets: components["schemas"]["Vector"][][];
            /** @description Natural duration of each character's whole clip, in seconds. */
            duration: number[];
            /** @description As in Trust, in metres. */
            sigma: number[];
            /** @description As in Trust. */
            supported?: boolean[];
            /** @description Level of detail of each pose. */
            levels: components["schemas"]["LevelNumber"][];
            /** @description Pixels that the error of the level covers. Absent without a camera. */
            error_px?: number[];
            /** @description Names of the curves. Absent for models without curves. */
            curve_names?: string[];
            /** @description Value of each curve for each character, within the limits on the card. Absent for models without curves. */
            curves?: number[][];
        };
        ModelSummary: {
            name: string;
            identity: components["schemas"]["Identity"];
            /** @description Available versions, the newest first. */
            versions: components["schemas"]["Identity"][];
            description: string;
        };
        ModelList: {
            models: components["schemas"]["ModelSummary"][];
        };
        /** @description An OpenAPI document. */
        ContractDocument: {
            openapi: string;
            info: Record<string, never>;
            paths: Record<string, never>;
        };
        Liveness: {
            /** @constant */
            status: "live";
            /** @description `info.version` of this document. Since 2.1.0. */
            contract?: string;
        };
        Readiness: {
            /** @constant */
            status: "ready";
            models: components["schemas"]["Identity"][];
            reload: components["schemas"]["Reload"];
        };
        /** @description Statistics of the checks for new model files since the start of the service. */
        Reload: {
            /** @description Number of checks. */
            looks: number;
            /** @description Number of versions opened, including those at the start. */
            opened: number;
            /** @description Number of failed attempts; a persistent failure counts once. */
            failed: number;
            /**
             * Format: date-time
             * @description Time of the last change of the models.
             */
            changed: string;
            /** @description Present errors. Versions that were in service before stay in service. */
            faults: {
                /** @description Name of the model; empty for an error of a whole folder or store. */
                model: string;
                /** @description Version name of the model file if the model has several versions. */
                version: string;
                detail: string;
            }[];
        };
        /** @description A problem as in RFC 9457. Every error of this service has this schema. */
        Problem: {
            /** @enum {string} */
            type: "urn:posefield:problem:bad-parameter" | "urn:posefield:problem:bad-body" | "urn:posefield:problem:unauthenticated" | "urn:posefield:problem:forbidden" | "urn:posefield:problem:no-such-path" | "urn:posefield:problem:unknown-model" | "urn:posefield:problem:unknown-format" | "urn:posefield:problem:method-not-allowed" | "urn:posefield:problem:not-acceptable" | "urn:posefield:problem:body-too-large" | "urn:posefield:problem:url-too-long" | "urn:posefield:problem:unsupported-media-type" | "urn:posefield:problem:invalid-field" | "urn:posefield:problem:outside-samples" | "urn:posefield:problem:out-of-reach" | "urn:posefield:problem:overloaded" | "urn:posefield:problem:late" | "urn:posefield:problem:not-ready" | "urn:posefield:problem:unknown-host" | "urn:posefield:problem:head-too-large" | "urn:posefield:problem:internal-error";
            title: string;
            status: number;
            /** @description The invalid value and the expected one, for people. */
            detail: string;
            /** @description Id of the request. */
            instance: string;
            /** @description Locations of the error in the request, if it has a single location. */
            errors: ({
                /** @description JSON pointer into the body (RFC 6901). */
                pointer?: string;
                /** @description Name of a query or path parameter. */
                parameter?: string;
                detail: string;
            } & (unknown | unknown))[];
        };
    };
    responses: {
        /** @description The walking crowd. Default format: binary USD. */
        Crowd: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Warning": components["headers"]["Warning"];
                [name: string]: unknown;
            };
            content: {
                "model/vnd.usdc": string;
                "model/vnd.usda": string;
                "model/vnd.usdz+zip": string;
            };
        };
        /** @description The people on their tracks. */
        TrackedCrowd: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Warning": components["headers"]["Warning"];
                [name: string]: unknown;
            };
            content: {
                "model/vnd.usda": string;
                "model/vnd.usdc": string;
                "model/vnd.usdz+zip": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
                "application/vnd.asam.osi": string;
            };
        };
        /** @description The poses. Default format: Arrow stream. */
        CrowdPoses: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                [name: string]: unknown;
            };
            content: {
                "application/vnd.apache.arrow.stream": string;
                "application/x-npz": string;
                "application/vnd.msgpack": string;
                "application/json": components["schemas"]["CrowdPoses"];
            };
        };
        /** @description The poses and their uncertainty. Default format: JSON. */
        Poses: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["OwnDisposition"];
                [name: string]: unknown;
            };
            content: {
                "application/json": components["schemas"]["PoseAnswer"];
                "application/vnd.msgpack": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
            };
        };
        /** @description The clip. Default format: binary USD. */
        Clip: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Sigma": components["headers"]["Sigma"];
                "Posefield-Duration": components["headers"]["Duration"];
                "Posefield-Inferred": components["headers"]["Inferred"];
                "Posefield-Supported": components["headers"]["Supported"];
                "Posefield-Warning": components["headers"]["Warning"];
                "Posefield-Missed": components["headers"]["Missed"];
                [name: string]: unknown;
            };
            content: {
                "model/vnd.usdc": string;
                "model/vnd.usda": string;
                "model/vnd.usdz+zip": string;
                "application/json": components["schemas"]["ClipDocument"];
                "application/x-bvh": string;
                "model/gltf-binary": string;
                "model/vnd.vrma": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
                "application/vnd.msgpack": string;
            };
        };
        /** @description The clip in the format of the path. */
        ClipFile: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Sigma": components["headers"]["Sigma"];
                "Posefield-Duration": components["headers"]["Duration"];
                "Posefield-Inferred": components["headers"]["Inferred"];
                "Posefield-Supported": components["headers"]["Supported"];
                "Posefield-Warning": components["headers"]["Warning"];
                "Posefield-Missed": components["headers"]["Missed"];
                [name: string]: unknown;
            };
            content: {
                "model/vnd.usdc": string;
                "model/vnd.usda": string;
                "model/vnd.usdz+zip": string;
                "application/json": components["schemas"]["ClipDocument"];
                "application/x-bvh": string;
                "model/gltf-binary": string;
                "model/vnd.vrma": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
                "application/vnd.msgpack": string;
                "text/csv": string;
                "text/plain": string;
                "application/octet-stream": string;
            };
        };
        /** @description Suggested clips to capture. */
        Suggestions: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content: {
                "application/json": components["schemas"]["Suggestions"];
            };
        };
        /** @description The captured clips behind the response, and their weights. */
        Reasons: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content: {
                "application/json": components["schemas"]["Reasons"];
            };
        };
        /** @description The grid. Default format: JSON. */
        SigmaGrid: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                [name: string]: unknown;
            };
            content: {
                "application/json": components["schemas"]["SigmaGrid"];
                "application/vnd.msgpack": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
            };
        };
        /** @description The archive. Default format: zip. */
        Performances: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Warning": components["headers"]["Warning"];
                [name: string]: unknown;
            };
            content: {
                "application/zip": string;
                "application/x-tar": string;
            };
        };
        /** @description The performance as a clip, or its plan. Default format: JSON. */
        Performance: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Sigma": components["headers"]["Sigma"];
                "Posefield-Duration": components["headers"]["Duration"];
                "Posefield-Supported": components["headers"]["Supported"];
                "Posefield-Warning": components["headers"]["Warning"];
                [name: string]: unknown;
            };
            content: {
                "model/vnd.usdc": string;
                "model/vnd.usda": string;
                "model/vnd.usdz+zip": string;
                "application/json": components["schemas"]["PerformanceDocument"];
                "application/x-bvh": string;
                "model/gltf-binary": string;
                "model/vnd.vrma": string;
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
                "application/vnd.msgpack": string;
            };
        };
        /** @description The archive. Default format: zip. */
        Clips: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Disposition": components["headers"]["Disposition"];
                "Posefield-Model": components["headers"]["Model"];
                "Posefield-Warning": components["headers"]["Warning"];
                [name: string]: unknown;
            };
            content: {
                "application/zip": string;
                "application/x-tar": string;
            };
        };
        /** @description This document, byte for byte. */
        ContractYaml: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["PageCacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content: {
                "application/yaml": components["schemas"]["ContractDocument"];
            };
        };
        /** @description This document as JSON. */
        ContractJson: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["PageCacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content: {
                "application/json": components["schemas"]["ContractDocument"];
            };
        };
        /** @description A self-contained HTML page. */
        Page: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["PageCacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                "Content-Security-Policy": components["headers"]["PagePolicy"];
                [name: string]: unknown;
            };
            content: {
                "text/html": string;
            };
        };
        /** @description The document matches If-None-Match. */
        PageNotModified: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["PageCacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content?: never;
        };
        /** @description The request violates this document. The model was not evaluated. */
        BadRequest: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This service requires a key or a token, and the request has none or an invalid one. */
        Unauthenticated: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                "WWW-Authenticate": components["headers"]["Challenge"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The key or token lacks the scope of this operation. */
        Forbidden: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                "WWW-Authenticate": components["headers"]["Challenge"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description Unknown model or format, or a model outside the key's scope. */
        NotFound: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The path does not support this method. */
        MethodNotAllowed: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                Allow: components["headers"]["Allow"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description `Accept` allows none of the formats of this path; `detail` lists them. Parts of the header that cannot be parsed are ignored. */
        NotAcceptable: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The URL exceeds the limit, by default 8 KiB. */
        UrlTooLong: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The header `Host` is neither an IP address nor a name that the operator has listed. */
        UnknownHost: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The headers together exceed the limit, by default 16 KiB, or number more than 100. */
        HeadTooLarge: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The body exceeds the limit, by default 64 KiB. The server closes the connection. */
        BodyTooLarge: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The body is neither `application/json` in UTF-8 nor another media type of the path. */
        UnsupportedMediaType: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The request is valid, but the model cannot respond to it. Causes: an unknown control or one out of range (for a crowd, also a missing one), an unknown performer or level, a time outside the clip, too many frames, an invalid constraint, or, with `extrapolate` set to `refuse`, controls without similar captured clips or a target out of reach. */
        Unanswerable: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The response matches If-None-Match. The model was not evaluated. */
        NotModified: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                ETag: components["headers"]["ETag"];
                Vary: components["headers"]["Vary"];
                [name: string]: unknown;
            };
            content?: never;
        };
        /** @description The service is overloaded, or the response took too long. The client may repeat the request later. */
        Overloaded: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                "Retry-After": components["headers"]["RetryAfter"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The service is not ready. Do not send requests now. */
        NotReady: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description Internal error of the service. */
        InternalError: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                "Cache-Control": components["headers"]["CacheControl"];
                Link: components["headers"]["Help"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
    };
    parameters: {
        /**
         * @description Model name, or name@hash.
         * @example reach
         */
        model: string;
        /**
         * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack.
         * @example usda
         */
        clipFormat: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "vrma" | "npz" | "arrow" | "msgpack";
        /**
         * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack; of a model of a robot also a reference motion, such as `mjlab.npz` (since 5.2.0).
         * @example usda
         */
        clipEnding: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "vrma" | "npz" | "arrow" | "msgpack" | "unitree.csv" | "qpos.csv" | "holosoma.npz" | "mjlab.npz" | "beyondmimic.npz" | "isaaclab.npz" | "locomujoco.npz" | "qpos.npz" | "gmr.pkl" | "mimickit.pkl" | "asap.pkl" | "awd.json" | "amp.txt";
        /**
         * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
         * @example json
         */
        tableFormat: "json" | "msgpack" | "npz" | "arrow";
        /**
         * @description An Arrow stream, NumPy arrays, MessagePack or JSON.
         * @example json
         */
        crowdFormat: "arrow" | "npz" | "msgpack" | "json";
        /**
         * @description USD text, binary USD or a USDZ package.
         * @example usdc
         */
        walkFormat: "usda" | "usdc" | "usdz";
        /**
         * @description USD; NumPy arrays or an Arrow stream of joints or bones; an OSI trace; or a table of bones for CARLA.
         * @example usdc
         */
        tracksFormat: "usda" | "usdc" | "usdz" | "npz" | "bones.npz" | "arrow" | "osi" | "carla.npz";
        /**
         * @description A zip or tar archive.
         * @example zip
         */
        archiveFormat: "zip" | "tar";
        /**
         * @description One query parameter for each control of the model, with the control's name:
         *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
         *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
         *     range widths outside is an error. A value acts as if it were at most a quarter of the range
         *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
         *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
         *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
         *     near the other controls, the labels that are named, and the targets; with targets, also
         *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
         *     `exact` set to the measured controls given before (`none` if there are none), gets the same
         *     response. The names of the other parameters are reserved.
         * @example {
         *       "stature": 1.72,
         *       "hip_height": 0.9,
         *       "turn": 20,
         *       "target_height": 1.1
         *     }
         */
        controls: {
            [key: string]: number;
        };
        /** @description True for the plan of a performance: the JSON response without the poses. */
        plan: boolean;
        /** @description Animations in USD files; other formats refuse `segments`. With `segments`, each segment has a SkelAnimation under `/Performance/Segments` beside the whole one, which alone is bound. Since 4.2.0. */
        layout: components["schemas"]["PerformanceLayout"];
        /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
        ifNoneMatch: string;
        /**
         * @description Seconds from the start of the clip, at most its duration. Repeat the parameter for several poses.
         * @example [
         *       0,
         *       0.5
         *     ]
         */
        time: number[];
        /** @description Frame rate in frames a second. A clip has at most 10,000 frames. */
        fps: number;
        /** @description Time of the first frame, in seconds from the start of the whole clip. */
        start: number;
        /** @description Latest time of the last frame, in seconds from the start of the whole clip. Default: the clip's duration. With an event or a target, a clip that is no cycle ends on a frame: its time is stretched by up to half a frame. */
        end: number;
        /** @description Naming convention of the joints. */
        names: components["schemas"]["Names"];
        /** @description Whether the root travels, stays in place, or is a bone of its own. */
        root: components["schemas"]["Root"];
        /** @description Whether the clip is one whole cycle. */
        loop: components["schemas"]["Loop"];
        /** @description Policy for clips in which a robot's joint turns beyond its limits. */
        limits: components["schemas"]["Limits"];
        /** @description Whether the trust includes sigma for each joint. */
        jointSigma: components["schemas"]["JointSigma"];
        /**
         * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
         *     model can measure on a motion), `none`, or control names separated by commas.
         * @example none
         */
        exact: string;
        /**
         * @description Target position of a joint at a moment, JOINT@MOMENT:X,Y,Z in metres. The moment is `at` of
         *     the schema Target, or `time` in seconds. Repeat the parameter for several targets.
         * @example [
         *       "RightHand@end:0.3,1.2,0.4"
         *     ]
         */
        target: string[];
        /** @description Whether feet stand where they contact the ground. Default: `stand` for models that travel and know the contacts of their feet. */
        feet: "stand" | "as_predicted";
        /**
         * @description Floor on which feet stand, in the frame of the clip: its height in metres, or HEIGHT, SLOPE_X,SLOPE_Z, the height at the origin and the rise for each metre along x and z. Expects feet that stand. Since 4.0.0.
         * @example 0,0,0.15
         */
        floor: string;
        /** @description Seed of another take of the motion. A seed is one smooth function of the controls, and two characters with one seed move alike. 0 is the prediction, the mean of all takes. */
        take: components["schemas"]["Take"];
        /** @description Size of a take's deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. */
        variety: components["schemas"]["Variety"];
        /** @description Whether to add details of a cycle that no control predicts, sampled by the seed `take`. A warning reports a model that has none. */
        detail: components["schemas"]["Detail"];
        /** @description Unit of length in the file. Default: the format's usual unit. glTF accepts only `m`. */
        unit: "m" | "cm";
        /** @description Up axis of the file. Default: the format's usual axis. With `z`, a character that faces straight ahead faces -Y. glTF accepts only `y`. */
        up: "y" | "z";
        /** @description Body in USD and glTF files. `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. Formats without a body refuse it. */
        body: "none" | "mannequin" | "bones";
        /**
         * @description Character of a user that moves, one of `/v1/characters`. USD files refer to its file by a reference and copy neither bind pose nor skin; glTF files have the animation of its nodes alone; other formats have its skeleton. Default: the character of the model. Since 4.3.0.
         * @example hero
         */
        character: components["schemas"]["CharacterName"];
        /** @description Body of all characters: `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. */
        crowdBody: "none" | "mannequin" | "bones";
        /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
        extrapolate: components["schemas"]["Extrapolate"];
        /** @description Number of characters. */
        count: number;
        /** @description Number of distinct motions that the characters share. Default: one motion per character. Not valid with a camera. */
        motions: number;
        /** @description Duration in seconds. */
        seconds: number;
        /** @description Frame rate in frames a second. */
        crowdFps: number;
        /** @description Seed of all random numbers. */
        seed: number;
        /**
         * @description Camera position x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest level if all errors are larger. A transition between levels takes 0.25 s. The camera must not be inside a character.
         * @example 30,1.7,-60
         */
        camera: string;
        /** @description Maximum number of captured clips in the list, the nearest first. */
        nearest: components["schemas"]["Nearest"];
        /** @description Number of points. */
        suggestions: number;
        /**
         * @description Performer whose clips alone count as captured, one of `performers` on the model's card. Default: the clips of all performers count.
         * @example tall
         */
        whose: string;
        /**
         * @description Name of a label set whose clips alone count as captured, `label=style=angry`, as for other requests. Since 3.1.0.
         * @example [
         *       "performer=tall"
         *     ]
         */
        whoseLabel: string[];
        /**
         * @description Control that varies from column to column.
         * @example turn
         */
        across: components["schemas"]["ControlName"];
        /**
         * @description Control that varies from row to row; different from `across`.
         * @example target_height
         */
        along: components["schemas"]["ControlName"];
        /** @description Number of values of `across`, evenly spaced from the smallest to the largest sampled value. */
        columns: components["schemas"]["GridSteps"];
        /** @description Number of values of `along`. The default limit of the whole grid is 65,536 points. */
        rows: components["schemas"]["GridSteps"];
        /** @description Margin of the grid beyond the sampled range on either side, as a share of that range. */
        margin: components["schemas"]["Margin"];
        /** @description One parameter for each other control with a value other than its default. */
        fixedControls: {
            [key: string]: number;
        };
        /** @description Vertical field of view of the camera in radians. Default: 60 degrees. Requires `camera`. */
        fov: number;
        /** @description Height of the image in pixels. Default: 1080. Requires `camera`. */
        height: number;
        /** @description Maximum number of pixels that a level's error may cover. Default: 1. Requires `camera`. */
        pixels: number;
        /** @description Whether feet stand where they contact the ground, planned over each character's whole walk. Default: `stand` for models that know the contacts of their feet, for 20 frames a second or more. Poses of crowds at single times have feet as predicted. Since 4.0.0. */
        walkFeet: "stand" | "as_predicted";
        /** @description Seed of another take of all characters' motions, or `index` for seeds from 1 on in the order of the distinct motions, so that no two characters walk alike. Durations and travel stay those of the prediction, so that characters stay on their paths. Since 4.0.0. */
        walkTake: components["schemas"]["Take"] | "index";
        /** @description Size of the takes' deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. Since 4.0.0. */
        walkVariety: components["schemas"]["Variety"];
        /** @description Whether to add details that no control predicts, sampled by the takes' seeds. A warning reports a model that has none. Since 4.0.0. */
        walkDetail: components["schemas"]["Detail"];
        /** @description Sharing of data between characters. `references` opens in every application that composes layers. `scenegraph` is the cheapest to draw, but Blender imports it as one character at rest. `flatten` writes one layer for readers without composition, such as three.js. */
        instancing: "references" | "scenegraph" | "flatten";
        /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
        level: components["schemas"]["LevelNumber"];
        /**
         * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
         *     without named performers refuses every name.
         * @example tall
         */
        performer: string;
        /**
         * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
         *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
         *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
         *     open. `performer` is short for the label set of that name. Since 3.1.0.
         * @example [
         *       "performer=tall"
         *     ]
         */
        label: string[];
        /**
         * @description Name of all characters in one of `labels` on the model's card, `label=style=angry`, or weights
         *     of names, `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and
         *     at most 1; what is left to 1 stays open. One parameter for each label set. In sets without one
         *     each character has the names of a captured clip. Since 3.3.0.
         * @example [
         *       "performer=tall"
         *     ]
         */
        walkLabel: string[];
    };
    requestBodies: {
        /** @description Limits: 256 KiB, 256 segments and ten minutes. */
        PerformanceQuestion: {
            content: {
                "application/json": components["schemas"]["PerformanceQuestion"];
            };
        };
        /** @description Default limits: 8 MiB, 256 scripts, 1,024 segments in all, and 1,800 seconds in all. */
        PerformancesQuestion: {
            content: {
                "application/json": components["schemas"]["PerformancesQuestion"];
            };
        };
        /** @description Default limits: 32 MiB and 100,000 characters. */
        CrowdQuestion: {
            content: {
                "application/json": components["schemas"]["CrowdQuestion"];
            };
        };
        /** @description Default limits: 32 MiB, 100,000 people, 36,000 frames from the first sample of all to the last, and 500,000 poses: people times frames. */
        TracksQuestion: {
            content: {
                "application/json": components["schemas"]["TracksQuestion"];
            };
        };
        /** @description Default limits: 8 MiB, 10,000 clips, 1,000,000 frames in all, and a total target cost of 2,000. A target costs 1, or 4 if the clip omits controls. */
        ClipsQuestion: {
            content: {
                "application/json": components["schemas"]["ClipsQuestion"];
            };
        };
        ClipQuestion: {
            content: {
                "application/json": components["schemas"]["ClipQuestion"];
            };
        };
    };
    headers: {
        /** @description Authentication scheme, `Bearer`, and the error of the credentials that were sent (RFC 6750). */
        Challenge: string;
        /** @description Id of the request; also `instance` of a problem. */
        RequestId: string;
        /** @description Methods of this path. */
        Allow: string;
        /**
         * @description Strong entity tag of these bytes. It depends only on the model file and the request, so a
         *     comparison needs no evaluation of the model. Send it in If-None-Match.
         */
        ETag: string;
        /** @description Responses under `name@hash` are immutable. Responses under a plain name must be revalidated, unless the operator configures otherwise. All other responses must not be stored. */
        CacheControl: string;
        /** @description Any cache may store the response but must revalidate it. */
        PageCacheControl: "public, no-cache";
        /** @description The page may load no external resources. Its own styles and scripts are listed by digest. */
        PagePolicy: string;
        /** @description Link to the explanation of this problem on `/problems`. */
        Help: string;
        /** @description Request headers on which the response depends. */
        Vary: string;
        /** @description Seconds until the client should repeat the request. */
        RetryAfter: number;
        /** @description File name from the model's name. */
        Disposition: string;
        /** @description File name from the model's name; absent for JSON. */
        OwnDisposition: string;
        /** @description Model of the response, as name@hash. */
        Model: components["schemas"]["Identity"];
        /** @description `sigma` of Trust, in metres. */
        Sigma: number;
        /** @description `duration` of Trust, in seconds. */
        Duration: number;
        /**
         * @description Values of the omitted controls, set to the conditional mean given the other controls: a JSON
         *     object in ASCII. Absent if no control was omitted. Since 2.2.0.
         */
        Inferred: string;
        /** @description `supported` of Trust. Always present since 2.2.0. */
        Supported: "true" | "false";
        /**
         * @description One header line per warning; absent without warnings. Each value is a JSON string in ASCII,
         *     so that the lines, joined by commas and enclosed in brackets, form a JSON array.
         */
        Warning: string;
        /**
         * @description One header line per element of `targets` in Trust that is not reached; absent if all are
         *     reached. Each value is a JSON object in ASCII with `what`, `miss` and `unit`, so that the
         *     lines, joined by commas and enclosed in brackets, form a JSON array.
         */
        Missed: string;
    };
    pathItems: never;
}
export type $defs = Record<string, never>;
export interface operations {
    listModels: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The models of this service. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ModelList"];
                };
            };
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getModel: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The model card. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    ETag: components["headers"]["ETag"];
                    Vary: components["headers"]["Vary"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ModelCard"];
                };
            };
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getCharacter: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The character. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    ETag: components["headers"]["ETag"];
                    "Content-Disposition": components["headers"]["Disposition"];
                    [name: string]: unknown;
                };
                content: {
                    "model/gltf-binary": string;
                };
            };
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getPose: {
        parameters: {
            query: {
                /**
                 * @description One query parameter for each control of the model, with the control's name:
                 *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
                 *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
                 *     range widths outside is an error. A value acts as if it were at most a quarter of the range
                 *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
                 *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
                 *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
                 *     near the other controls, the labels that are named, and the targets; with targets, also
                 *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
                 *     `exact` set to the measured controls given before (`none` if there are none), gets the same
                 *     response. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /**
                 * @description Seconds from the start of the clip, at most its duration. Repeat the parameter for several poses.
                 * @example [
                 *       0,
                 *       0.5
                 *     ]
                 */
                time: components["parameters"]["time"];
                /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
                /** @description Whether the trust includes sigma for each joint. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
                 *     model can measure on a motion), `none`, or control names separated by commas.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description Target position of a joint at a moment, JOINT@MOMENT:X,Y,Z in metres. The moment is `at` of
                 *     the schema Target, or `time` in seconds. Repeat the parameter for several targets.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Seed of another take of the motion. A seed is one smooth function of the controls, and two characters with one seed move alike. 0 is the prediction, the mean of all takes. */
                take?: components["parameters"]["take"];
                /** @description Size of a take's deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. */
                variety?: components["parameters"]["variety"];
                /** @description Whether to add details of a cycle that no control predicts, sampled by the seed `take`. A warning reports a model that has none. */
                detail?: components["parameters"]["detail"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Poses"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPose: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PoseQuestion"];
            };
        };
        responses: {
            200: components["responses"]["Poses"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getPoseInFormat: {
        parameters: {
            query: {
                /**
                 * @description One query parameter for each control of the model, with the control's name:
                 *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
                 *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
                 *     range widths outside is an error. A value acts as if it were at most a quarter of the range
                 *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
                 *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
                 *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
                 *     near the other controls, the labels that are named, and the targets; with targets, also
                 *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
                 *     `exact` set to the measured controls given before (`none` if there are none), gets the same
                 *     response. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /**
                 * @description Seconds from the start of the clip, at most its duration. Repeat the parameter for several poses.
                 * @example [
                 *       0,
                 *       0.5
                 *     ]
                 */
                time: components["parameters"]["time"];
                /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
                /** @description Whether the trust includes sigma for each joint. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
                 *     model can measure on a motion), `none`, or control names separated by commas.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description Target position of a joint at a moment, JOINT@MOMENT:X,Y,Z in metres. The moment is `at` of
                 *     the schema Target, or `time` in seconds. Repeat the parameter for several targets.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Seed of another take of the motion. A seed is one smooth function of the controls, and two characters with one seed move alike. 0 is the prediction, the mean of all takes. */
                take?: components["parameters"]["take"];
                /** @description Size of a take's deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. */
                variety?: components["parameters"]["variety"];
                /** @description Whether to add details of a cycle that no control predicts, sampled by the seed `take`. A warning reports a model that has none. */
                detail?: components["parameters"]["detail"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Poses"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPoseInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PoseQuestion"];
            };
        };
        responses: {
            200: components["responses"]["Poses"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getClip: {
        parameters: {
            query?: {
                /**
                 * @description One query parameter for each control of the model, with the control's name:
                 *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
                 *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
                 *     range widths outside is an error. A value acts as if it were at most a quarter of the range
                 *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
                 *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
                 *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
                 *     near the other controls, the labels that are named, and the targets; with targets, also
                 *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
                 *     `exact` set to the measured controls given before (`none` if there are none), gets the same
                 *     response. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description Frame rate in frames a second. A clip has at most 10,000 frames. */
                fps?: components["parameters"]["fps"];
                /** @description Time of the first frame, in seconds from the start of the whole clip. */
                start?: components["parameters"]["start"];
                /** @description Latest time of the last frame, in seconds from the start of the whole clip. Default: the clip's duration. With an event or a target, a clip that is no cycle ends on a frame: its time is stretched by up to half a frame. */
                end?: components["parameters"]["end"];
                /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
                /** @description Whether the trust includes sigma for each joint. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /** @description Naming convention of the joints. */
                names?: components["parameters"]["names"];
                /** @description Whether the root travels, stays in place, or is a bone of its own. */
                root?: components["parameters"]["root"];
                /** @description Whether the clip is one whole cycle. */
                loop?: components["parameters"]["loop"];
                /**
                 * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
                 *     model can measure on a motion), `none`, or control names separated by commas.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description Target position of a joint at a moment, JOINT@MOMENT:X,Y,Z in metres. The moment is `at` of
                 *     the schema Target, or `time` in seconds. Repeat the parameter for several targets.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet stand where they contact the ground. Default: `stand` for models that travel and know the contacts of their feet. */
                feet?: components["parameters"]["feet"];
                /**
                 * @description Floor on which feet stand, in the frame of the clip: its height in metres, or HEIGHT, SLOPE_X,SLOPE_Z, the height at the origin and the rise for each metre along x and z. Expects feet that stand. Since 4.0.0.
                 * @example 0,0,0.15
                 */
                floor?: components["parameters"]["floor"];
                /** @description Policy for clips in which a robot's joint turns beyond its limits. */
                limits?: components["parameters"]["limits"];
                /** @description Seed of another take of the motion. A seed is one smooth function of the controls, and two characters with one seed move alike. 0 is the prediction, the mean of all takes. */
                take?: components["parameters"]["take"];
                /** @description Size of a take's deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. */
                variety?: components["parameters"]["variety"];
                /** @description Whether to add details of a cycle that no control predicts, sampled by the seed `take`. A warning reports a model that has none. */
                detail?: components["parameters"]["detail"];
                /** @description Unit of length in the file. Default: the format's usual unit. glTF accepts only `m`. */
                unit?: components["parameters"]["unit"];
                /** @description Up axis of the file. Default: the format's usual axis. With `z`, a character that faces straight ahead faces -Y. glTF accepts only `y`. */
                up?: components["parameters"]["up"];
                /** @description Body in USD and glTF files. `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. Formats without a body refuse it. */
                body?: components["parameters"]["body"];
                /**
                 * @description Character of a user that moves, one of `/v1/characters`. USD files refer to its file by a reference and copy neither bind pose nor skin; glTF files have the animation of its nodes alone; other formats have its skeleton. Default: the character of the model. Since 4.3.0.
                 * @example hero
                 */
                character?: components["parameters"]["character"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Clip"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryClip: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["ClipQuestion"];
        responses: {
            200: components["responses"]["Clip"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getClipInFormat: {
        parameters: {
            query?: {
                /**
                 * @description One query parameter for each control of the model, with the control's name:
                 *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
                 *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
                 *     range widths outside is an error. A value acts as if it were at most a quarter of the range
                 *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
                 *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
                 *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
                 *     near the other controls, the labels that are named, and the targets; with targets, also
                 *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
                 *     `exact` set to the measured controls given before (`none` if there are none), gets the same
                 *     response. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description Frame rate in frames a second. A clip has at most 10,000 frames. */
                fps?: components["parameters"]["fps"];
                /** @description Time of the first frame, in seconds from the start of the whole clip. */
                start?: components["parameters"]["start"];
                /** @description Latest time of the last frame, in seconds from the start of the whole clip. Default: the clip's duration. With an event or a target, a clip that is no cycle ends on a frame: its time is stretched by up to half a frame. */
                end?: components["parameters"]["end"];
                /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
                /** @description Whether the trust includes sigma for each joint. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /** @description Naming convention of the joints. */
                names?: components["parameters"]["names"];
                /** @description Whether the root travels, stays in place, or is a bone of its own. */
                root?: components["parameters"]["root"];
                /** @description Whether the clip is one whole cycle. */
                loop?: components["parameters"]["loop"];
                /**
                 * @description Measured controls that the motion must match exactly: `auto` (all given controls that the
                 *     model can measure on a motion), `none`, or control names separated by commas.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description Target position of a joint at a moment, JOINT@MOMENT:X,Y,Z in metres. The moment is `at` of
                 *     the schema Target, or `time` in seconds. Repeat the parameter for several targets.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet stand where they contact the ground. Default: `stand` for models that travel and know the contacts of their feet. */
                feet?: components["parameters"]["feet"];
                /**
                 * @description Floor on which feet stand, in the frame of the clip: its height in metres, or HEIGHT, SLOPE_X,SLOPE_Z, the height at the origin and the rise for each metre along x and z. Expects feet that stand. Since 4.0.0.
                 * @example 0,0,0.15
                 */
                floor?: components["parameters"]["floor"];
                /** @description Policy for clips in which a robot's joint turns beyond its limits. */
                limits?: components["parameters"]["limits"];
                /** @description Seed of another take of the motion. A seed is one smooth function of the controls, and two characters with one seed move alike. 0 is the prediction, the mean of all takes. */
                take?: components["parameters"]["take"];
                /** @description Size of a take's deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. */
                variety?: components["parameters"]["variety"];
                /** @description Whether to add details of a cycle that no control predicts, sampled by the seed `take`. A warning reports a model that has none. */
                detail?: components["parameters"]["detail"];
                /** @description Unit of length in the file. Default: the format's usual unit. glTF accepts only `m`. */
                unit?: components["parameters"]["unit"];
                /** @description Up axis of the file. Default: the format's usual axis. With `z`, a character that faces straight ahead faces -Y. glTF accepts only `y`. */
                up?: components["parameters"]["up"];
                /** @description Body in USD and glTF files. `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. Formats without a body refuse it. */
                body?: components["parameters"]["body"];
                /**
                 * @description Character of a user that moves, one of `/v1/characters`. USD files refer to its file by a reference and copy neither bind pose nor skin; glTF files have the animation of its nodes alone; other formats have its skeleton. Default: the character of the model. Since 4.3.0.
                 * @example hero
                 */
                character?: components["parameters"]["character"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack; of a model of a robot also a reference motion, such as `mjlab.npz` (since 5.2.0).
                 * @example usda
                 */
                format: components["parameters"]["clipEnding"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["ClipFile"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryClipInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack; of a model of a robot also a reference motion, such as `mjlab.npz` (since 5.2.0).
                 * @example usda
                 */
                format: components["parameters"]["clipEnding"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["ClipQuestion"];
        responses: {
            200: components["responses"]["ClipFile"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryClips: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["ClipsQuestion"];
        responses: {
            200: components["responses"]["Clips"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryClipsInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description A zip or tar archive.
                 * @example zip
                 */
                format: components["parameters"]["archiveFormat"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["ClipsQuestion"];
        responses: {
            200: components["responses"]["Clips"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getCrowd: {
        parameters: {
            query?: {
                /** @description Number of characters. */
                count?: components["parameters"]["count"];
                /** @description Number of distinct motions that the characters share. Default: one motion per character. Not valid with a camera. */
                motions?: components["parameters"]["motions"];
                /** @description Duration in seconds. */
                seconds?: components["parameters"]["seconds"];
                /** @description Frame rate in frames a second. */
                fps?: components["parameters"]["crowdFps"];
                /** @description Seed of all random numbers. */
                seed?: components["parameters"]["seed"];
                /**
                 * @description Name of all characters in one of `labels` on the model's card, `label=style=angry`, or weights
                 *     of names, `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and
                 *     at most 1; what is left to 1 stays open. One parameter for each label set. In sets without one
                 *     each character has the names of a captured clip. Since 3.3.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["walkLabel"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Camera position x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest level if all errors are larger. A transition between levels takes 0.25 s. The camera must not be inside a character.
                 * @example 30,1.7,-60
                 */
                camera?: components["parameters"]["camera"];
                /** @description Vertical field of view of the camera in radians. Default: 60 degrees. Requires `camera`. */
                fov?: components["parameters"]["fov"];
                /** @description Height of the image in pixels. Default: 1080. Requires `camera`. */
                height?: components["parameters"]["height"];
                /** @description Maximum number of pixels that a level's error may cover. Default: 1. Requires `camera`. */
                pixels?: components["parameters"]["pixels"];
                /** @description Whether feet stand where they contact the ground, planned over each character's whole walk. Default: `stand` for models that know the contacts of their feet, for 20 frames a second or more. Poses of crowds at single times have feet as predicted. Since 4.0.0. */
                feet?: components["parameters"]["walkFeet"];
                /** @description Seed of another take of all characters' motions, or `index` for seeds from 1 on in the order of the distinct motions, so that no two characters walk alike. Durations and travel stay those of the prediction, so that characters stay on their paths. Since 4.0.0. */
                take?: components["parameters"]["walkTake"];
                /** @description Size of the takes' deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. Since 4.0.0. */
                variety?: components["parameters"]["walkVariety"];
                /** @description Whether to add details that no control predicts, sampled by the takes' seeds. A warning reports a model that has none. Since 4.0.0. */
                detail?: components["parameters"]["walkDetail"];
                /** @description Sharing of data between characters. `references` opens in every application that composes layers. `scenegraph` is the cheapest to draw, but Blender imports it as one character at rest. `flatten` writes one layer for readers without composition, such as three.js. */
                instancing?: components["parameters"]["instancing"];
                /** @description Body of all characters: `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. */
                body?: components["parameters"]["crowdBody"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Crowd"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryCrowd: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["CrowdQuestion"];
        responses: {
            200: components["responses"]["CrowdPoses"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getCrowdInFormat: {
        parameters: {
            query?: {
                /** @description Number of characters. */
                count?: components["parameters"]["count"];
                /** @description Number of distinct motions that the characters share. Default: one motion per character. Not valid with a camera. */
                motions?: components["parameters"]["motions"];
                /** @description Duration in seconds. */
                seconds?: components["parameters"]["seconds"];
                /** @description Frame rate in frames a second. */
                fps?: components["parameters"]["crowdFps"];
                /** @description Seed of all random numbers. */
                seed?: components["parameters"]["seed"];
                /**
                 * @description Name of all characters in one of `labels` on the model's card, `label=style=angry`, or weights
                 *     of names, `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and
                 *     at most 1; what is left to 1 stays open. One parameter for each label set. In sets without one
                 *     each character has the names of a captured clip. Since 3.3.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["walkLabel"];
                /** @description Level of detail, an index into `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Camera position x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest level if all errors are larger. A transition between levels takes 0.25 s. The camera must not be inside a character.
                 * @example 30,1.7,-60
                 */
                camera?: components["parameters"]["camera"];
                /** @description Vertical field of view of the camera in radians. Default: 60 degrees. Requires `camera`. */
                fov?: components["parameters"]["fov"];
                /** @description Height of the image in pixels. Default: 1080. Requires `camera`. */
                height?: components["parameters"]["height"];
                /** @description Maximum number of pixels that a level's error may cover. Default: 1. Requires `camera`. */
                pixels?: components["parameters"]["pixels"];
                /** @description Whether feet stand where they contact the ground, planned over each character's whole walk. Default: `stand` for models that know the contacts of their feet, for 20 frames a second or more. Poses of crowds at single times have feet as predicted. Since 4.0.0. */
                feet?: components["parameters"]["walkFeet"];
                /** @description Seed of another take of all characters' motions, or `index` for seeds from 1 on in the order of the distinct motions, so that no two characters walk alike. Durations and travel stay those of the prediction, so that characters stay on their paths. Since 4.0.0. */
                take?: components["parameters"]["walkTake"];
                /** @description Size of the takes' deviations from the prediction; 1 is that of captured clips. Without a take it changes nothing. Since 4.0.0. */
                variety?: components["parameters"]["walkVariety"];
                /** @description Whether to add details that no control predicts, sampled by the takes' seeds. A warning reports a model that has none. Since 4.0.0. */
                detail?: components["parameters"]["walkDetail"];
                /** @description Sharing of data between characters. `references` opens in every application that composes layers. `scenegraph` is the cheapest to draw, but Blender imports it as one character at rest. `flatten` writes one layer for readers without composition, such as three.js. */
                instancing?: components["parameters"]["instancing"];
                /** @description Body of all characters: `mannequin` is a person fitted to joints with the roles of one and `bones` on others, `bones` one box for each bone, `none` the skeleton alone. Default: `mannequin`. */
                body?: components["parameters"]["crowdBody"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description USD text, binary USD or a USDZ package.
                 * @example usdc
                 */
                format: components["parameters"]["walkFormat"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Crowd"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryCrowdInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description An Arrow stream, NumPy arrays, MessagePack or JSON.
                 * @example json
                 */
                format: components["parameters"]["crowdFormat"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["CrowdQuestion"];
        responses: {
            200: components["responses"]["CrowdPoses"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryTracksInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description USD; NumPy arrays or an Arrow stream of joints or bones; an OSI trace; or a table of bones for CARLA.
                 * @example usdc
                 */
                format: components["parameters"]["tracksFormat"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["TracksQuestion"];
        responses: {
            200: components["responses"]["TrackedCrowd"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getWhy: {
        parameters: {
            query?: {
                /**
                 * @description One query parameter for each control of the model, with the control's name:
                 *     `?stature=1.72&turn=20`. The model's card gives names, units and sampled ranges. A value
                 *     outside the sampled range gives a warning (see `extrapolate`); a value more than a hundred
                 *     range widths outside is an error. A value acts as if it were at most a quarter of the range
                 *     outside, and with controls outside a clip is at most a quarter shorter or longer than the
                 *     captured ones, or as at the nearest sampled controls (since 3.1.0; see `deviations` of
                 *     Trust). Omitted controls (since 2.2.0) are set to those of a captured clip that is typical
                 *     near the other controls, the labels that are named, and the targets; with targets, also
                 *     between such clips. The trust lists the omitted controls as `inferred`. A request with the inferred values, and with
                 *     `exact` set to the measured controls given before (`none` if there are none), gets the same
                 *     response. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description Maximum number of captured clips in the list, the nearest first. */
                nearest?: components["parameters"]["nearest"];
                /** @description Policy for controls without similar captured clips and for targets out of reach: respond, respond with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Reasons"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryWhy: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["WhyQuestion"];
            };
        };
        responses: {
            200: components["responses"]["Reasons"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getSuggestions: {
        parameters: {
            query?: {
                /** @description Number of points. */
                count?: components["parameters"]["suggestions"];
                /**
                 * @description Performer whose clips alone count as captured, one of `performers` on the model's card. Default: the clips of all performers count.
                 * @example tall
                 */
                performer?: components["parameters"]["whose"];
                /**
                 * @description Name of a label set whose clips alone count as captured, `label=style=angry`, as for other requests. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["whoseLabel"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Suggestions"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getSigma: {
        parameters: {
            query: {
                /**
                 * @description Control that varies from column to column.
                 * @example turn
                 */
                across: components["parameters"]["across"];
                /**
                 * @description Control that varies from row to row; different from `across`.
                 * @example target_height
                 */
                along: components["parameters"]["along"];
                /** @description Number of values of `across`, evenly spaced from the smallest to the largest sampled value. */
                columns?: components["parameters"]["columns"];
                /** @description Number of values of `along`. The default limit of the whole grid is 65,536 points. */
                rows?: components["parameters"]["rows"];
                /** @description Margin of the grid beyond the sampled range on either side, as a share of that range. */
                margin?: components["parameters"]["margin"];
                /** @description One parameter for each other control with a value other than its default. */
                controls?: components["parameters"]["fixedControls"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["SigmaGrid"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    querySigma: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SigmaQuestion"];
            };
        };
        responses: {
            200: components["responses"]["SigmaGrid"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getSigmaInFormat: {
        parameters: {
            query: {
                /**
                 * @description Control that varies from column to column.
                 * @example turn
                 */
                across: components["parameters"]["across"];
                /**
                 * @description Control that varies from row to row; different from `across`.
                 * @example target_height
                 */
                along: components["parameters"]["along"];
                /** @description Number of values of `across`, evenly spaced from the smallest to the largest sampled value. */
                columns?: components["parameters"]["columns"];
                /** @description Number of values of `along`. The default limit of the whole grid is 65,536 points. */
                rows?: components["parameters"]["rows"];
                /** @description Margin of the grid beyond the sampled range on either side, as a share of that range. */
                margin?: components["parameters"]["margin"];
                /** @description One parameter for each other control with a value other than its default. */
                controls?: components["parameters"]["fixedControls"];
                /**
                 * @description Performer, one of `performers` on the model's card. Default: an unseen performer. A model
                 *     without named performers refuses every name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /**
                 * @description Name in one of `labels` on the model's card, `label=style=angry`, or weights of names,
                 *     `label=style=angry:0.7,happy:0.3`. Each weight is 0 to 1, and their sum is above 0 and at most
                 *     1; what is left to 1 stays open. One parameter for each label set; sets without one are left
                 *     open. `performer` is short for the label set of that name. Since 3.1.0.
                 * @example [
                 *       "performer=tall"
                 *     ]
                 */
                label?: components["parameters"]["label"];
            };
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["SigmaGrid"];
            304: components["responses"]["NotModified"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    querySigmaInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description Model name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description JSON, MessagePack, NumPy arrays or an Arrow stream.
                 * @example json
                 */
                format: components["parameters"]["tableFormat"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SigmaQuestion"];
            };
        };
        responses: {
            200: components["responses"]["SigmaGrid"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    listCharacters: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The characters of this service. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["CharacterList"];
                };
            };
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPerformance: {
        parameters: {
            query?: {
                /** @description True for the plan of a performance: the JSON response without the poses. */
                plan?: components["parameters"]["plan"];
                /** @description Animations in USD files; other formats refuse `segments`. With `segments`, each segment has a SkelAnimation under `/Performance/Segments` beside the whole one, which alone is bound. Since 4.2.0. */
                layout?: components["parameters"]["layout"];
                /**
                 * @description Character of a user that moves, one of `/v1/characters`. USD files refer to its file by a reference and copy neither bind pose nor skin; glTF files have the animation of its nodes alone; other formats have its skeleton. Default: the character of the model. Since 4.3.0.
                 * @example hero
                 */
                character?: components["parameters"]["character"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: components["requestBodies"]["PerformanceQuestion"];
        responses: {
            200: components["responses"]["Performance"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPerformanceInFormat: {
        parameters: {
            query?: {
                /** @description True for the plan of a performance: the JSON response without the poses. */
                plan?: components["parameters"]["plan"];
                /** @description Animations in USD files; other formats refuse `segments`. With `segments`, each segment has a SkelAnimation under `/Performance/Segments` beside the whole one, which alone is bound. Since 4.2.0. */
                layout?: components["parameters"]["layout"];
                /**
                 * @description Character of a user that moves, one of `/v1/characters`. USD files refer to its file by a reference and copy neither bind pose nor skin; glTF files have the animation of its nodes alone; other formats have its skeleton. Default: the character of the model. Since 4.3.0.
                 * @example hero
                 */
                character?: components["parameters"]["character"];
            };
            header?: never;
            path: {
                /**
                 * @description File format: USD text, binary USD, a USDZ package, JSON, BVH, glTF, a VRM animation, NumPy arrays, an Arrow stream or MessagePack.
                 * @example usda
                 */
                format: components["parameters"]["clipFormat"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["PerformanceQuestion"];
        responses: {
            200: components["responses"]["Performance"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPerformances: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: components["requestBodies"]["PerformancesQuestion"];
        responses: {
            200: components["responses"]["Performances"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            406: components["responses"]["NotAcceptable"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    queryPerformancesInFormat: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description A zip or tar archive.
                 * @example zip
                 */
                format: components["parameters"]["archiveFormat"];
            };
            cookie?: never;
        };
        requestBody: components["requestBodies"]["PerformancesQuestion"];
        responses: {
            200: components["responses"]["Performances"];
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["NotFound"];
            405: components["responses"]["MethodNotAllowed"];
            413: components["responses"]["BodyTooLarge"];
            414: components["responses"]["UrlTooLong"];
            415: components["responses"]["UnsupportedMediaType"];
            421: components["responses"]["UnknownHost"];
            422: components["responses"]["Unanswerable"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Overloaded"];
        };
    };
    getMetrics: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Metrics in the Prometheus text format. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    [name: string]: unknown;
                };
                content: {
                    "text/plain": string;
                };
            };
            400: components["responses"]["BadRequest"];
            401: components["responses"]["Unauthenticated"];
            403: components["responses"]["Forbidden"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getLiveness: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The process responds. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Liveness"];
                };
            };
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getReadiness: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description All models are ready. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    "Cache-Control": components["headers"]["CacheControl"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Readiness"];
                };
            };
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["NotReady"];
        };
    };
    getContract: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["ContractYaml"];
            304: components["responses"]["PageNotModified"];
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getContractJson: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["ContractJson"];
            304: components["responses"]["PageNotModified"];
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getViewer: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Page"];
            304: components["responses"]["PageNotModified"];
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getDocs: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Page"];
            304: components["responses"]["PageNotModified"];
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
    getProblems: {
        parameters: {
            query?: never;
            header?: {
                /** @description Entity tags of responses in the client's cache. If one matches, the response is 304 without a body. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: components["responses"]["Page"];
            304: components["responses"]["PageNotModified"];
            400: components["responses"]["BadRequest"];
            405: components["responses"]["MethodNotAllowed"];
            414: components["responses"]["UrlTooLong"];
            421: components["responses"]["UnknownHost"];
            431: components["responses"]["HeadTooLarge"];
            500: components["responses"]["InternalError"];
        };
    };
}
/** Version of the contract that this is made from. */
export const CONTRACT = "5.2.0";

/** Keys that every document has. */
export const REQUIRED = {
  "CharacterList": [
    "characters",
    "faults"
  ],
  "ModelCard": [
    "identity",
    "name",
    "description",
    "controls",
    "skeleton",
    "units",
    "cyclic",
    "root",
    "rate",
    "frames",
    "samples",
    "levels",
    "durations",
    "labels",
    "performers",
    "examples",
    "moved_by",
    "feet",
    "diagnostics",
    "provenance",
    "roles",
    "sources",
    "kriging"
  ],
  "ModelList": [
    "models"
  ],
  "PerformanceReport": [
    "models",
    "character",
    "duration",
    "frames",
    "sigma",
    "supported",
    "segments",
    "joins",
    "warnings"
  ],
  "Problem": [
    "type",
    "title",
    "status",
    "detail",
    "instance",
    "errors"
  ],
  "Readiness": [
    "status",
    "models",
    "reload"
  ],
  "Reasons": [
    "model",
    "controls",
    "performer",
    "warnings",
    "nearest",
    "others"
  ],
  "SigmaGrid": [
    "model",
    "across",
    "along",
    "controls",
    "performer",
    "units",
    "across_values",
    "along_values",
    "sigma",
    "inside"
  ],
  "Suggestions": [
    "model",
    "performer",
    "candidates",
    "suggestions"
  ],
  "Trust": [
    "model",
    "controls",
    "performer",
    "level",
    "duration",
    "sigma",
    "warnings"
  ]
} as const;

/** Parameters that are lists. */
export const LISTS = {
  "CharacterList": [
    "characters",
    "faults"
  ],
  "ModelCard": [
    "controls",
    "levels",
    "durations",
    "labels",
    "performers",
    "examples",
    "moved_by",
    "feet",
    "sources"
  ],
  "ModelList": [
    "models"
  ],
  "PerformanceReport": [
    "models",
    "segments",
    "joins",
    "warnings"
  ],
  "Problem": [
    "errors"
  ],
  "Readiness": [
    "models"
  ],
  "Reasons": [
    "warnings",
    "nearest"
  ],
  "SigmaGrid": [
    "across_values",
    "along_values",
    "sigma",
    "inside"
  ],
  "Suggestions": [
    "suggestions"
  ],
  "Trust": [
    "warnings"
  ]
} as const;

/** Media types of the files of each format. */
export const MEDIA_TYPES = {
  "usda": "model/vnd.usda",
  "usdc": "model/vnd.usdc",
  "usdz": "model/vnd.usdz+zip",
  "json": "application/json",
  "bvh": "application/x-bvh",
  "glb": "model/gltf-binary",
  "vrma": "model/vnd.vrma",
  "npz": "application/x-npz",
  "arrow": "application/vnd.apache.arrow.stream",
  "msgpack": "application/vnd.msgpack",
  "unitree.csv": "text/csv",
  "qpos.csv": "text/csv",
  "holosoma.npz": "application/x-npz",
  "mjlab.npz": "application/x-npz",
  "beyondmimic.npz": "application/x-npz",
  "isaaclab.npz": "application/x-npz",
  "locomujoco.npz": "application/x-npz",
  "qpos.npz": "application/x-npz",
  "gmr.pkl": "application/octet-stream",
  "mimickit.pkl": "application/octet-stream",
  "asap.pkl": "application/octet-stream",
  "awd.json": "text/plain",
  "amp.txt": "text/plain",
  "bones.npz": "application/x-npz",
  "osi": "application/vnd.asam.osi",
  "carla.npz": "application/x-npz",
  "zip": "application/zip",
  "tar": "application/x-tar"
} as const;

/** Everything that may be wrong. */
export const PROBLEM_TYPES = [
  "urn:posefield:problem:bad-parameter",
  "urn:posefield:problem:bad-body",
  "urn:posefield:problem:unauthenticated",
  "urn:posefield:problem:forbidden",
  "urn:posefield:problem:no-such-path",
  "urn:posefield:problem:unknown-model",
  "urn:posefield:problem:unknown-format",
  "urn:posefield:problem:method-not-allowed",
  "urn:posefield:problem:not-acceptable",
  "urn:posefield:problem:body-too-large",
  "urn:posefield:problem:url-too-long",
  "urn:posefield:problem:unsupported-media-type",
  "urn:posefield:problem:invalid-field",
  "urn:posefield:problem:outside-samples",
  "urn:posefield:problem:out-of-reach",
  "urn:posefield:problem:overloaded",
  "urn:posefield:problem:late",
  "urn:posefield:problem:not-ready",
  "urn:posefield:problem:unknown-host",
  "urn:posefield:problem:head-too-large",
  "urn:posefield:problem:internal-error"
] as const;
