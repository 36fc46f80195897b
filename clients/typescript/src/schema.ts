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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a model's card
         * @description What the model says of itself - its controls and their ranges, its skeleton, what training measured.
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
    "/v1/models/{model}/pose": {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /**
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get poses at given times
         * @description As JSON, or in the format that `Accept` prefers.
         */
        get: operations["getPose"];
        put?: never;
        /**
         * Query poses at given times
         * @description As JSON, or in the format that `Accept` prefers. Poses at many control points are a crowd's.
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
                 * @description A model's name, or name@hash.
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
         * @description As `json`, `msgpack`, `npz` or `arrow`.
         */
        get: operations["getPoseInFormat"];
        put?: never;
        /**
         * Query poses at given times in a format
         * @description As `json`, `msgpack`, `npz` or `arrow`.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a clip in the format that is accepted
         * @description As binary USD, or in the format that `Accept` prefers; each has a path of its own too.
         */
        get: operations["getClip"];
        put?: never;
        /**
         * Query a clip in the format that is accepted
         * @description As binary USD, or in the format that `Accept` prefers; each has a path of its own too.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description Extension of the file: USD text, binary USD, a USDZ package, JSON, BVH, glTF, NumPy arrays, an Arrow stream or MessagePack.
                 * @example usda
                 */
                format: components["parameters"]["clipFormat"];
            };
            cookie?: never;
        };
        /**
         * Get a clip in a format
         * @description As `usda`, `usdc`, `usdz`, `json`, `bvh`, `glb`, `npz`, `arrow` or `msgpack`. In metres with Y up, if not asked otherwise; BVH usually in centimetres, and glTF in metres with Y up alone.
         */
        get: operations["getClipInFormat"];
        put?: never;
        /**
         * Query a clip in a format
         * @description As `usda`, `usdc`, `usdz`, `json`, `bvh`, `glb`, `npz`, `arrow` or `msgpack`. In metres with Y up, if not asked otherwise; BVH usually in centimetres, and glTF in metres with Y up alone.
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
                 * @description A model's name, or name@hash.
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
         * @description As zip, or in the format that `Accept` prefers. The archive is sent while the clips are made: one file each, named after it, in the order of the question, the same as the path of its format answers with. The last is `manifest.jsonl`; an answer that ends without it broke off.
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
                 * @description A model's name, or name@hash.
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
         * Query many clips as an archive of a format
         * @description As `zip` or `tar`. The archive is sent while the clips are made: one file each, named after it, in the order of the question, the same as the path of its format answers with. The last is `manifest.jsonl`; an answer that ends without it broke off.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a crowd that walks in the format that is accepted
         * @description As binary USD, or in the format that `Accept` prefers. Each character goes its own way at its own changing speed, the same for the same seed. For models of a cycle that travels. USDZ is sent while it is made, a single layer once it is whole.
         */
        get: operations["getCrowd"];
        put?: never;
        /**
         * Query poses of a crowd in the format that is accepted
         * @description As an Arrow stream, or in the format that `Accept` prefers. It is also the way to ask for poses at many control points at once: each is a character at the origin.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get a crowd that walks in a format
         * @description As `usda`, `usdc` or `usdz`. Each character goes its own way at its own changing speed, the same for the same seed. For models of a cycle that travels. USDZ is sent while it is made, a single layer once it is whole.
         */
        get: operations["getCrowdInFormat"];
        put?: never;
        /**
         * Query poses of a crowd in a format
         * @description As `arrow`, `npz`, `msgpack`, or `json` for at most 1,000 characters.
         */
        post: operations["queryCrowdInFormat"];
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get what an answer is made of
         * @description The captured clips nearest to these controls, and what each counts for in the poses of the finest level.
         */
        get: operations["getWhy"];
        put?: never;
        /**
         * Query what an answer is made of
         * @description The captured clips nearest to these controls, and what each counts for in the poses of the finest level.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get which clips to capture next
         * @description Points within what was sampled at which one more captured clip would say most of what is asked of the model, the one that is worth most first.
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
            };
            cookie?: never;
        };
        /**
         * Get sigma over two controls
         * @description How far a captured clip would lie from the answer, over all values of two controls, at the finest level of detail, and whether anything like them was captured. As JSON, or in the format that `Accept` prefers.
         */
        get: operations["getSigma"];
        put?: never;
        /**
         * Query sigma over two controls
         * @description How far a captured clip would lie from the answer, over all values of two controls, at the finest level of detail, and whether anything like them was captured. As JSON, or in the format that `Accept` prefers.
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
                 * @description A model's name, or name@hash.
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
         * @description As `json`, `msgpack`, `npz` or `arrow`. How far a captured clip would lie from the answer, over all values of two controls, at the finest level of detail, and whether anything like them was captured.
         */
        get: operations["getSigmaInFormat"];
        put?: never;
        /**
         * Query sigma over two controls in a format
         * @description As `json`, `msgpack`, `npz` or `arrow`. How far a captured clip would lie from the answer, over all values of two controls, at the finest level of detail, and whether anything like them was captured.
         */
        post: operations["querySigmaInFormat"];
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
         * Get what is counted
         * @description For Prometheus: latencies by operation, format and status, open requests, poses answered together, answers
         *     that clients had already, versions of models.
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
        /** Whether the process answers */
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
         * Whether the models answer
         * @description The newest model of each name is asked a trial question, at most once a second, and must answer
         *     as when it was opened. Model files that are new and cannot be used are listed: the version
         *     before them answers. 503 when a model answers otherwise, when there is none, and from the
         *     moment that the service is told to end.
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
         * @description Byte for byte, with its comments.
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
         * @description The same, for what reads no YAML.
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
         * Play with the models
         * @description As a page with sliders, a character, and what the answers are worth. It loads nothing from elsewhere.
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
         * Read this document
         * @description As a page on which each operation can be searched for and tried. It loads nothing from elsewhere.
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
         * Read what each problem means
         * @description As a page for people, `#` and the last part of a problem's `type` leads to it.
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
        /** @description name@hash of a model; answers under it never change. */
        Identity: string;
        /**
         * @description What joints are called: as in the motion that the model was trained from, or as Mixamo,
         *     Unreal's mannequin, VRM or HumanIK call those that have one of the card's `roles`; the others
         *     keep their names. Names are all that changes: bones keep their axes and lengths, so that a
         *     motion still has to be retargeted to a character of that kind. A model without roles has no
         *     answer but for `own`.
         * @default own
         * @enum {string}
         */
        Names: "own" | "mixamo" | "ue5" | "vrm" | "humanik";
        /**
         * @description In place, the frame that goes evenly along a cycle's arc is taken out, heading and all, or, of
         *     what is no cycle, the straight way from the first pose of the whole clip to its last, evenly,
         *     while the heading stays. Heights stay. A model that is in place already is as it is.
         * @default travelling
         * @enum {string}
         */
        Root: "travelling" | "in_place";
        /**
         * @description One whole cycle as N = max(1, round(duration * fps)) even steps, N + 1 frames: without `start`
         *     and `end`. The last frame is exactly the first, or, where the root travels, the first carried by
         *     the cycle's way and turn. The file plays N / fps seconds; the trust's `duration` is the
         *     model's. A model that is not cyclic has no answer.
         * @default false
         */
        Loop: boolean;
        /**
         * @description Whether the trust says sigma of each joint, too: `joint_sigma`. Files that hold no trust (BVH) do not say it.
         * @default false
         */
        JointSigma: boolean;
        /**
         * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that the
         *     model can measure on a motion: they have a `measure` on its card), `none`, or their names. The
         *     motion is the nearest to the predicted one, as captured motions stray from predictions, that
         *     does.
         * @default auto
         */
        Exact: ("auto" | "none") | components["schemas"]["ControlName"][];
        /**
         * @description A joint that is to be in its place at a moment: at a time, or at the start, the end, the event
         *     that the model's recipe names, or where the joint is highest, lowest or farthest from the root.
         *     The motion that meets it is the nearest to the predicted one, as captured motions stray from
         *     predictions. What lies farther off than they stray is approached as far as they go, and
         *     `targets` in Trust says by how much it is missed. A joint has one target at one moment.
         */
        Target: {
            /**
             * @description Name of a joint, as the model's own skeleton has it.
             * @example RightHand
             */
            joint: string;
            /**
             * @description Where it is to be, x y z, m, in the frame of the clip: that in which the root travels.
             * @example [
             *       0.3,
             *       1.2,
             *       0.4
             *     ]
             */
            position: number[];
            /** @description Seconds from the start of the clip, up to its duration. */
            time?: number;
            at?: components["schemas"]["Moment"];
        } & (unknown | unknown);
        /** @enum {string} */
        Moment: "start" | "end" | "event" | "highest" | "lowest" | "farthest";
        /**
         * @description Joints that are to be in their places. Of a control that the same joint is measured for, the target is the nearer word.
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
         * @description Whether feet that stand stay where they stand.
         * @default false
         */
        PinFeet: boolean;
        /**
         * @description The file's unit of length; null for the format's usual one. glTF is always in metres.
         * @default null
         * @enum {string|null}
         */
        Unit: "m" | "cm" | null;
        /**
         * @description The axis that is up in the file; null for the format's usual one. Where it is Z a character that faces straight ahead faces -Y. In glTF Y is always up.
         * @default null
         * @enum {string|null}
         */
        Up: "y" | "z" | null;
        /**
         * @description What to do with controls like which nothing was captured: `ok` says no more of it than `supported`;
         *     `warn` adds a sentence for each control outside its sampled range, or one where the controls lie in
         *     a gap of what was sampled, and one for each target out of reach; `refuse` answers none of these.
         * @default warn
         * @enum {string}
         */
        Extrapolate: "ok" | "warn" | "refuse";
        /**
         * @description Who moves, of the `performers` that the model's card names; null for somebody who was never seen.
         * @default null
         * @example tall
         */
        Performer: string | null;
        /**
         * @description Level of detail, of the `levels` on the model's card; 0 is the finest.
         * @default 0
         * @example 1
         */
        LevelNumber: number;
        /**
         * @description A number for each control of the model, in the control's unit. In a question some or all of them
         *     may be left out, of a crowd none: they are then the most typical for those that are given and for the performer.
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
             * @description Seconds from the start of the clip, up to its duration.
             * @example [
             *       0,
             *       0.5
             *     ]
             */
            times: number[];
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            pin_feet?: components["schemas"]["PinFeet"];
        };
        ClipQuestion: {
            controls: components["schemas"]["Controls"];
            /**
             * @description Frames a second.
             * @default 30
             */
            fps: number;
            /**
             * @description Seconds to the first frame.
             * @default 0
             */
            start: number;
            /**
             * @description Seconds that the last frame does not pass; null for the clip's duration.
             * @default null
             */
            end: number | null;
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["Root"];
            loop?: components["schemas"]["Loop"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            pin_feet?: components["schemas"]["PinFeet"];
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
        };
        /** @default 10 */
        Nearest: number;
        WhyQuestion: {
            controls: components["schemas"]["Controls"];
            nearest?: components["schemas"]["Nearest"];
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
        };
        /**
         * @description Whatever the time, the poses are a weighted sum of the captured clips, in the coordinates of the
         *     model's motion tensor. All weights, those of `nearest` and of `others`, add up to one. A weight may
         *     be negative: a clip that others hide, or from which the field is carried on, is taken away.
         */
        Reasons: {
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            /** @description Who was asked for; null for somebody who was never seen. */
            performer: string | null;
            /** @description As in Trust. */
            warnings: string[];
            inferred?: components["schemas"]["Inferred"];
            support?: components["schemas"]["Backing"];
            /** @description The nearest first. */
            nearest: components["schemas"]["CapturedClip"][];
            /** @description How many clips are not listed, and what they count for together. */
            others: {
                count: number;
                weight: number;
            };
        };
        /** @description Whether anything like these controls was captured, and by what that was told. */
        Backing: {
            supported: components["schemas"]["Supported"];
            /** @description How far each control lies beyond its sampled range, as a share of it. */
            beyond: {
                [key: string]: number;
            };
            /** @description The share beyond which nothing is supported. */
            most_beyond: number;
            /** @description Of a plain field over the controls of the captured clips, from 0 where many are near to 1 where none is. */
            variance: number;
            /** @description The variance above which nothing is supported. */
            most_variance: number;
        };
        /** @description Each point is ranked as if those before it had been captured already. */
        Suggestions: {
            model: components["schemas"]["Identity"];
            /** @description Whose clips alone counted as captured; null for everybody's. */
            performer: string | null;
            /** @description Of how many points these were chosen. */
            candidates: number;
            /** @description The one that is worth most first. */
            suggestions: components["schemas"]["Suggestion"][];
        };
        Suggestion: {
            controls: components["schemas"]["Controls"];
            /** @description Share by which the mean of `variance`, as Backing has it, falls over all that may be asked, once this is captured. */
            gain: number;
            /** @description As Backing has it, at the point itself, before. */
            variance: number;
            /** @description Source of the captured clip nearest to it. */
            nearest: string;
            lacking: components["schemas"]["ControlName"];
            /** @description By how much the nearest clip differs in that control, in which it differs most, as a share of its range. */
            gap: number;
        };
        CapturedClip: {
            /** @description The motion file, and the frames of it where the clip is a part. */
            source: string;
            controls: components["schemas"]["Controls"];
            /** @description Who moved; null where performers are not told apart. */
            performer: string | null;
            /** @description From the controls asked for in the model's own metric. At one, two clips have almost nothing to do with each other. */
            distance: number;
            /** @description What it counts for. */
            weight: number;
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
         * @description A number for each control that is no axis; of those left out the card's default.
         * @example {
         *       "stature": 1.72
         *     }
         */
        FixedControls: {
            [key: string]: number;
        };
        /** @description By default for at most 65,536 points. */
        SigmaQuestion: {
            /** @description The control that changes from column to column. */
            across: components["schemas"]["ControlName"];
            /** @description Another control, which changes from row to row. */
            along: components["schemas"]["ControlName"];
            columns?: components["schemas"]["GridSteps"];
            rows?: components["schemas"]["GridSteps"];
            /** @description Share of a control's sampled range by which the grid goes beyond it on either side. */
            margin?: components["schemas"]["Margin"];
            controls?: components["schemas"]["FixedControls"];
            performer?: components["schemas"]["Performer"];
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
            /** @description Who was asked for; null for somebody who was never seen. */
            performer: string | null;
            units: {
                [key: string]: string;
            };
            /** @description For each column the value of `across`. */
            across_values: number[];
            /** @description For each row the value of `along`. */
            along_values: number[];
            /** @description For each row and column sigma as in Trust, m. */
            sigma: number[][];
            /** @description For each row and column whether every control lies in its sampled range. */
            inside: boolean[][];
            /** @description For each row and column `supported` as in Trust; always there since 2.2.0. */
            supported?: boolean[][];
        };
        /** @description Many clips in one format. All are looked at before the answer begins; one without an answer refuses all. */
        ClipsQuestion: {
            /**
             * @description Of all files, by their ending.
             * @enum {string}
             */
            format: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "npz" | "arrow" | "msgpack";
            unit?: components["schemas"]["Unit"];
            up?: components["schemas"]["Up"];
            clips: components["schemas"]["NamedClipQuestion"][];
        };
        /** @description A ClipQuestion, and what its file is called. */
        NamedClipQuestion: {
            /**
             * @description Name of the file but for its ending, no other clip's, be it in other capitals; if null, `clip-` and the clip's place, from 000000.
             * @default null
             * @example left
             */
            name: string | null;
            controls: components["schemas"]["Controls"];
            /**
             * @description Frames a second.
             * @default 30
             */
            fps: number;
            /**
             * @description Seconds to the first frame.
             * @default 0
             */
            start: number;
            /**
             * @description Seconds that the last frame does not pass; null for the clip's duration.
             * @default null
             */
            end: number | null;
            extrapolate?: components["schemas"]["Extrapolate"];
            performer?: components["schemas"]["Performer"];
            level?: components["schemas"]["LevelNumber"];
            joint_sigma?: components["schemas"]["JointSigma"];
            names?: components["schemas"]["Names"];
            root?: components["schemas"]["Root"];
            loop?: components["schemas"]["Loop"];
            exact?: components["schemas"]["Exact"];
            targets?: components["schemas"]["Targets"];
            pin_feet?: components["schemas"]["PinFeet"];
        };
        /** @description One clip of an archive, and how far it may be trusted. */
        ManifestEntry: {
            name: string;
            /** @description Path in the archive. */
            file: string;
            bytes: number;
            /** @description Of the file's content. */
            sha256: string;
            frames: number;
            fps: number;
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            performer: string | null;
            level: number;
            /** @description As in Trust, s. */
            duration: number;
            /** @description As in Trust, m. */
            sigma: number;
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
        };
        /** @description Where an answer comes from and what it is worth. */
        Trust: {
            model: components["schemas"]["Identity"];
            controls: components["schemas"]["Controls"];
            /** @description Who was asked for; null for somebody who was never seen. */
            performer: string | null;
            /** @description Level of detail, of those on the card; 0 is the finest. */
            level: number;
            /** @description Natural length of the whole clip at these controls, s. */
            duration: number;
            /** @description How far a captured clip at these controls would lie from this one, as a root-mean-square over joints and frames, m. */
            sigma: number;
            supported?: components["schemas"]["Supported"];
            performer_seen?: components["schemas"]["PerformerSeen"];
            joint_sigma?: components["schemas"]["SigmaByJoint"];
            /** @description One sentence for each control outside what was sampled, or one where the controls lie in a gap of it, and one for each of `targets` that is not reached. */
            warnings: string[];
            inferred?: components["schemas"]["Inferred"];
            /** @description The controls that can be measured on a motion, as this one has them, in their units; of clips, and of poses that are held to something. */
            measured?: {
                [key: string]: number;
            };
            /** @description Measured controls and targets that the motion was held to, and how far it stays from each; absent where there are none. */
            targets?: components["schemas"]["Met"][];
        };
        /**
         * @description Names of the controls that were left out, and are the most typical for those that were given and for
         *     targets; not there where none was. Since 2.2.0.
         */
        Inferred: string[];
        /** @description Whether anything like these controls was captured: no control lies more than a tenth of its range beyond it, and captured clips are near, so near as to 19 of 20 captured clips the others are. Always there since 2.2.0. */
        Supported: boolean;
        /** @description For each joint of the card sigma as it is of that joint alone, m; absent where it was not asked for. */
        SigmaByJoint: number[];
        /** @description Whether somebody captured was asked for; absent where the model tells nobody apart. */
        PerformerSeen: boolean;
        /** @description Something that a motion was held to. */
        Met: {
            /**
             * @description A control's name, or joint and moment of a target.
             * @example RightHand at end
             */
            what: string;
            /** @description How far the motion stays from it, in `unit`. */
            miss: number;
            /** @description m, m/s or deg. */
            unit: string;
            /** @description Whether it is met to a millimetre, or a thousandth of its unit. */
            reached: boolean;
        };
        /** @description For each time and joint a unit quaternion w x y z, local to the parent. */
        Rotations: components["schemas"]["Quaternion"][][];
        /** @description For each time the position of the root, m. */
        RootPosition: components["schemas"]["Vector"][];
        /** @description For each joint its translation from the parent at these controls, m. The root's is not used. */
        BoneOffsets: components["schemas"]["Vector"][];
        /** @description Poses of the joints that the model's card names, in its order. */
        PoseAnswer: {
            trust: components["schemas"]["Trust"];
            /** @description The times asked for, s. */
            times: number[];
            rotations: components["schemas"]["Rotations"];
            root_position: components["schemas"]["RootPosition"];
            bone_offsets: components["schemas"]["BoneOffsets"];
        };
        /** @description A clip with the skeleton that it moves. */
        ClipDocument: {
            trust: components["schemas"]["Trust"];
            /** @description What the numbers are; lengths are metres and Y is up, if nothing else was asked for. */
            units: {
                [key: string]: string;
            };
            /** @description The joints. */
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            /** @description Frames a second. */
            rate: number;
            frames: number;
            /** @description Seconds from the first frame, one for each frame. */
            times: number[];
            rotations: components["schemas"]["Rotations"];
            root_position: components["schemas"]["RootPosition"];
            bone_offsets: components["schemas"]["BoneOffsets"];
        };
        Quaternion: number[];
        Vector: number[];
        /** @description One control parameter, its unit and what of it was sampled. */
        Control: {
            name: string;
            unit: string;
            description: string;
            minimum: number;
            maximum: number;
            /** @description The sampled value in the middle. */
            default: number;
            /** @description The distinct sampled values where they are few, else empty. */
            values: number[];
            measure?: components["schemas"]["Measure"];
        };
        /** @description How a control is read off a motion; a control that somebody typed has none. Since 2.2.0. */
        Measure: {
            /**
             * @description `left`, `height` and `forward` are where a joint is at a moment, m, from where the root's first pose stands on the
             *     floor, as it faces; `step_length` is the greatest distance ahead that one foot gets of the other, m; `stride_length`,
             *     m, `speed`, m/s, and `turn`, degrees to the left, are of a whole cycle; `leg_length` and `stature`, m, are of the
             *     performer's bones and not of the motion.
             * @enum {string}
             */
            quantity: "left" | "height" | "forward" | "step_length" | "stride_length" | "speed" | "turn" | "leg_length" | "stature";
            /** @description Indices of the joints whose middle is looked at, of the two feet of a step, or of the bones of a leg. */
            joints?: number[];
            /**
             * @description The moment of a place; `farthest` is from the root.
             * @enum {string}
             */
            at?: "start" | "end" | "highest" | "lowest" | "farthest" | "landmark";
            /** @description Of the duration, at which the landmark is in the mean over captured clips. */
            share?: number;
        };
        /** @description Joints parents first, their rest offsets, and the end sites that no joint follows. At rest every rotation is the identity. */
        Skeleton: {
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            /** @description From the parent, m. */
            offsets: components["schemas"]["Vector"][];
            /** @description The joint that each end site hangs on. */
            tip_joints: number[];
            /** @description From that joint, m. */
            tip_offsets: components["schemas"]["Vector"][];
        };
        /** @description A level of detail. Errors are distances between its joints and those of the model that nothing is cut from, over random controls, performers and times, m. */
        Level: {
            /** @description Of degrees of freedom, frames and samples in the core tensor. */
            ranks: number[];
            /** @description How many of the captured clips are asked. */
            samples: number;
            /** @description Joints that move; the others keep the family's mean rotation. */
            joints: number[];
            /** @description Numbers of the file that the level reads. */
            numbers: number;
            /** @description The same in float32. */
            bytes: number;
            /** @description Multiply-adds of one pose. */
            operations: number;
            /** @description Root mean square. */
            rms: number;
            /** @description One joint in a hundred lies farther. */
            p99: number;
            /** @description The largest root mean square over the joints of one pose; what levels are chosen by. */
            pose: number;
            max: number;
            /** @description Root mean square of the joint that the motion is for, at its event. */
            effector: number | null;
        };
        /** @description Everything a client needs to know of a model but its weights. */
        ModelCard: {
            identity: components["schemas"]["Identity"];
            /** @description The name it was trained under. */
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
             * @description Whether the root travels.
             * @enum {string}
             */
            root: "travelling" | "in_place";
            /** @description Frames a second of the captured clips. */
            rate: number;
            /** @description Frames of the motion tensor. */
            frames: number;
            /** @description Captured clips in it. */
            samples: number;
            /** @description Levels of detail, the finest first. */
            levels: components["schemas"]["Level"][];
            /** @description Shortest and longest captured clip, s. */
            durations: number[];
            /** @description Who can be asked for by name; empty where performers are not told apart. */
            performers: string[];
            /** @description Controls of each captured clip. */
            examples: number[][];
            /** @description Whose each captured clip is, by place among the performers; empty where they are not told apart. */
            moved_by: number[];
            /** @description Joints that stand on the ground; empty where the recipe names none. */
            feet: number[];
            /** @description What training measured. */
            diagnostics: Record<string, never>;
            /** @description Recipe, hashes of the data, versions, licence. */
            provenance: Record<string, never>;
            /** @description Joints by the part that each plays, named as the bones of a VRM humanoid; empty where the recipe names none. */
            roles: {
                [key: string]: string;
            };
            /** @description File and frames of each captured clip. */
            sources: string[];
            /** @description How far each joint errs, as a share of sigma. */
            joint_sigma?: number[];
            /** @description Parameters of the kriging that weighs the captured clips. */
            kriging: {
                /** @enum {string} */
                covariance: "exponential" | "gaussian" | "spherical" | "matern32" | "matern52";
                /** @description Degrees of the drifts that are averaged. */
                drifts: (0 | 1)[];
                /** @description For each control, what half of its sampled range is worth as distance. */
                scales: number[];
                /** @description As a share of the sill. */
                nugget: number;
                /** @description Distance between two performers. */
                label: number;
            };
            /** @description How far each captured clip lies from what the others predict for it, as a root-mean-square over joints and frames, m. */
            left_out?: number[];
            /** @description What the motion is for; null where the recipe names nothing. */
            event?: {
                /** @description The joint that counts. */
                joint: number;
                /** @description When, as a share of the duration, in the mean over the captured clips. */
                share: number;
            } | null;
        };
        /** @description A number for each character, or one for all. */
        Column: number | number[];
        /** @description From the origin, m. */
        Place: number[];
        /**
         * @description Where one looks from and through what lens. It has no direction: a character behind it counts
         *     by its distance like any other, for a mirror or a shadow may show it. It may stand in nobody.
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
            /** @description Vertical field of view, rad. */
            fov: number;
            /** @description Height of the image, pixels. */
            height: number;
        };
        /**
         * @description One pose of each of many characters. All lists have one length, the number of characters, in
         *     one order; what is no list holds for each of them. Where nothing is a list there is one character.
         *     Crowds are the model's predictions: they are held to nothing.
         */
        CrowdQuestion: {
            /**
             * @description For each control of the model its values, in the control's unit. None may be left out.
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
             * @description Seconds from the start of each character's clip, up to its duration. Levels differ a little in how long a clip takes: but at level 0, asked for by number and not mixed, a time up to a tenth after the end is the end.
             * @example [
             *       0,
             *       0.5
             *     ]
             */
            time: components["schemas"]["Column"];
            /**
             * @description Where each character's own frame stands; the origin, if null.
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
             * @description Turn of each character about +Y, rad; one that faces +Z in its own frame faces +X at a quarter turn.
             * @default 0
             */
            heading: components["schemas"]["Column"];
            /**
             * @description Who each character is, of the `performers` that the model's card names; null for somebody who was never seen.
             * @default null
             */
            performer: (string | null) | (string | null)[];
            /**
             * @description Level of detail of each character, or `auto`: the coarsest whose error covers at most `pixels`
             *     pixels to the `camera`, or the finest, where none does.
             * @default 0
             */
            level: components["schemas"]["LevelNumber"] | components["schemas"]["LevelNumber"][] | "auto";
            /**
             * @description With `auto`, the levels of the answer before. A character then goes coarser only where the
             *     error is a fifth below the limit, so that nobody flickers while the camera trembles.
             * @default null
             */
            previous_level: components["schemas"]["LevelNumber"][] | null;
            /**
             * @description Levels that characters are on their way from, so that a switch does not pop: their poses
             *     are mixed with those of their level, which with `auto` is held meanwhile, at
             *     `previous_level`.
             * @default null
             */
            from_level: components["schemas"]["LevelNumber"][] | null;
            /**
             * @description With `from_level`, how much of their way characters have behind them, 0 to 1.
             * @default null
             */
            blend: number | number[] | null;
            /**
             * @description Needed with `auto`, and refused without.
             * @default null
             */
            camera: components["schemas"]["Camera"] | null;
            /**
             * @description With `auto`, pixels that an error may cover; 1, if null.
             * @default null
             */
            pixels: number | null;
            /**
             * @description With `auto`, milliseconds that all poses together may take by what the levels cost. Where
             *     `pixels` would take more, the limit is raised to the smallest that fits; where even the
             *     coarsest level does not, everything is at the coarsest. `warnings` says so.
             * @default null
             */
            budget_ms: number | null;
            /**
             * @description Whether characters walk away from where they were placed.
             * @default travelling
             * @enum {string}
             */
            root: "travelling" | "in_place";
            extrapolate?: components["schemas"]["Extrapolate"];
        };
        /** @description A pose of each character in the order of the question, of the joints that `names` names. */
        CrowdPoses: {
            model: components["schemas"]["Identity"];
            /** @description The joints. */
            names: string[];
            /** @description Index of each joint's parent; -1 for the root. */
            parents: number[];
            units: {
                [key: string]: string;
            };
            /** @description Sentences on the crowd as a whole. */
            warnings: string[];
            /** @description For each character and joint a unit quaternion w x y z, local to the parent, the root's in the world. */
            rotations: components["schemas"]["Quaternion"][][];
            /** @description For each character the position of the root in the world, m. */
            root_position: components["schemas"]["Vector"][];
            /** @description For each character and joint its translation from the parent, m. The root's is not used. */
            bone_offsets: components["schemas"]["Vector"][][];
            /** @description Natural length of each character's whole clip in seconds. */
            duration: number[];
            /** @description As in Trust, m. */
            sigma: number[];
            /** @description As in Trust. */
            supported?: boolean[];
            /** @description The level of detail of each pose. */
            levels: components["schemas"]["LevelNumber"][];
            /** @description Pixels that the error of the level covers; absent without a camera. */
            error_px?: number[];
        };
        ModelSummary: {
            name: string;
            identity: components["schemas"]["Identity"];
            /** @description All that answer, the newest first. */
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
            /** @description `info.version` of this document, since 2.1.0. */
            contract?: string;
        };
        Readiness: {
            /** @constant */
            status: "ready";
            models: components["schemas"]["Identity"][];
            reload: components["schemas"]["Reload"];
        };
        /** @description What has become of looking for new model files since the start. */
        Reload: {
            /** @description How often was looked. */
            looks: number;
            /** @description Versions that were opened, those at the start among them. */
            opened: number;
            /** @description Attempts that failed, one that stays so counted once. */
            failed: number;
            /**
             * Format: date-time
             * @description When the models last changed.
             */
            changed: string;
            /** @description What is wrong now. What answered before still does. */
            faults: {
                /** @description Name of the model; empty for a whole folder or store. */
                model: string;
                /** @description What its file is called besides, if it has several. */
                version: string;
                detail: string;
            }[];
        };
        /** @description A problem as RFC 9457 describes it. Every error of this service has this shape. */
        Problem: {
            /** @enum {string} */
            type: "urn:posefield:problem:bad-parameter" | "urn:posefield:problem:bad-body" | "urn:posefield:problem:unauthenticated" | "urn:posefield:problem:forbidden" | "urn:posefield:problem:no-such-path" | "urn:posefield:problem:unknown-model" | "urn:posefield:problem:unknown-format" | "urn:posefield:problem:method-not-allowed" | "urn:posefield:problem:not-acceptable" | "urn:posefield:problem:body-too-large" | "urn:posefield:problem:url-too-long" | "urn:posefield:problem:unsupported-media-type" | "urn:posefield:problem:invalid-field" | "urn:posefield:problem:outside-samples" | "urn:posefield:problem:out-of-reach" | "urn:posefield:problem:overloaded" | "urn:posefield:problem:late" | "urn:posefield:problem:not-ready" | "urn:posefield:problem:unknown-host" | "urn:posefield:problem:head-too-large" | "urn:posefield:problem:internal-error";
            title: string;
            status: number;
            /** @description What was found and what was expected, for people. */
            detail: string;
            /** @description The request's id. */
            instance: string;
            /** @description Where in the request the fault lies, as far as it lies in one place. */
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
        /** @description The crowd that walks; as binary USD, if nothing else is preferred. */
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
        /** @description The poses; as an Arrow stream, if nothing else is preferred. */
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
        /** @description The poses, and how far they may be trusted; as JSON, if nothing else is preferred. */
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
        /** @description The clip; as binary USD, if nothing else is preferred. */
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
                "application/x-npz": string;
                "application/vnd.apache.arrow.stream": string;
                "application/vnd.msgpack": string;
            };
        };
        /** @description Which clips to capture next. */
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
        /** @description What the answer is made of. */
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
        /** @description The grid; as JSON, if nothing else is preferred. */
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
        /** @description The archive; as zip, if nothing else is preferred. */
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
        /** @description This document. */
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
        /** @description A page of HTML that stands alone. */
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
        /** @description The document is the one that If-None-Match names. */
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
        /** @description The request breaks this document; nothing was asked of a model. */
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
        /** @description This service asks for a key or token, and there is none, or one that does not hold. */
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
        /** @description No such model, or none that the key may read, or no such format. */
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
        /** @description The path does not take this method. */
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
        /** @description `Accept` accepts none of the formats that this path answers in; the detail lists them. What of the header cannot be read counts for nothing. */
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
        /** @description The URL is longer than the service reads, by default 8 KiB. */
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
        /** @description The header `Host` names neither an address nor a name that the operator has listed. */
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
        /** @description All headers together are longer than the service reads, by default 16 KiB, or more than 100. */
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
        /** @description The body is larger than the service accepts, by default 64 KiB. The connection is closed. */
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
        /** @description The body is not `application/json` in UTF-8, nor of another type that the path takes. */
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
        /** @description The model has no answer - a control unknown or out of reach (of a crowd, missing), a performer or level it does not know, a time outside the clip, too many frames, something that no motion can be held to, or, with `extrapolate` refuse, controls like which nothing was captured or a target out of reach. */
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
        /** @description The answer is the one that If-None-Match names. No model was asked. */
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
        /** @description The service has too much to do, or the answer took too long. The same request will do later. */
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
        /** @description The service should not be sent requests now. */
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
        /** @description The service failed. */
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
         * @description A model's name, or name@hash.
         * @example reach
         */
        model: string;
        /**
         * @description Extension of the file: USD text, binary USD, a USDZ package, JSON, BVH, glTF, NumPy arrays, an Arrow stream or MessagePack.
         * @example usda
         */
        clipFormat: "usda" | "usdc" | "usdz" | "json" | "bvh" | "glb" | "npz" | "arrow" | "msgpack";
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
         * @description A zip or tar archive.
         * @example zip
         */
        archiveFormat: "zip" | "tar";
        /**
         * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
         *     The model's card gives their names, units and sampled ranges; a value outside the range is
         *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
         *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
         *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
         *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
         *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
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
        /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
        ifNoneMatch: string;
        /**
         * @description Seconds from the start of the clip, up to its duration. Repeated for several poses.
         * @example [
         *       0,
         *       0.5
         *     ]
         */
        time: number[];
        /** @description Frames a second. A clip has at most 10,000 frames. */
        fps: number;
        /** @description Seconds from the start of the whole clip to the first frame. */
        start: number;
        /** @description Seconds from the start of the whole clip that the last frame does not pass; by default its duration. */
        end: number;
        /** @description What joints are called. */
        names: components["schemas"]["Names"];
        /** @description Whether the root travels. */
        root: components["schemas"]["Root"];
        /** @description Whether the clip is a loop. */
        loop: components["schemas"]["Loop"];
        /** @description Whether the trust says how far each joint may err. */
        jointSigma: components["schemas"]["JointSigma"];
        /**
         * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that
         *     the model can measure on a motion), `none`, or names of controls with commas between.
         * @example none
         */
        exact: string;
        /**
         * @description A joint that is to be in its place at a moment, JOINT@MOMENT:X,Y,Z. See the schema Target: the
         *     moment is its `at`, or its `time` in seconds. Repeated for several.
         * @example [
         *       "RightHand@end:0.3,1.2,0.4"
         *     ]
         */
        target: string[];
        /** @description Whether feet that stand stay where they stand. */
        pinFeet: components["schemas"]["PinFeet"];
        /** @description The file's unit of length; the format's usual one, if left out. glTF has no other than `m`. */
        unit: "m" | "cm";
        /** @description The axis that is up in the file; the format's usual one, if left out. Where it is Z a character that faces straight ahead faces -Y. In glTF no other than `y` is up. */
        up: "y" | "z";
        /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
        extrapolate: components["schemas"]["Extrapolate"];
        /** @description Characters. */
        count: number;
        /** @description How many different motions they share; left out, each character has its own. Not with a camera. */
        motions: number;
        /** @description How long they walk. */
        seconds: number;
        /** @description Frames a second. */
        crowdFps: number;
        /** @description Of all that is random. */
        seed: number;
        /**
         * @description Where one looks from, x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest, where none does; a switch takes a quarter of a second. It may stand in nobody.
         * @example 30,1.7,-60
         */
        camera: string;
        /** @description How many captured clips are listed at most, the nearest first. */
        nearest: components["schemas"]["Nearest"];
        /** @description How many points. */
        suggestions: number;
        /**
         * @description Whose clips alone count as captured, of the `performers` that the model's card names; everybody's, if left out.
         * @example tall
         */
        whose: string;
        /**
         * @description The control that changes from column to column.
         * @example turn
         */
        across: components["schemas"]["ControlName"];
        /**
         * @description Another control, which changes from row to row.
         * @example target_height
         */
        along: components["schemas"]["ControlName"];
        /** @description Values of `across`, evenly from the least that was sampled to the greatest. */
        columns: components["schemas"]["GridSteps"];
        /** @description Values of `along`. By default at most 65,536 points in all. */
        rows: components["schemas"]["GridSteps"];
        /** @description Share of a control's sampled range by which the grid goes beyond it on either side. */
        margin: components["schemas"]["Margin"];
        /** @description One parameter for each other control that is not at its default. */
        fixedControls: {
            [key: string]: number;
        };
        /** @description With a camera, its vertical field of view, rad; 60 degrees, if left out. */
        fov: number;
        /** @description With a camera, the height of the image, pixels; 1080, if left out. */
        height: number;
        /** @description With a camera, how many pixels the error of a level may cover; 1, if left out. */
        pixels: number;
        /** @description What characters share. `references` opens in everything that composes layers, `scenegraph` is least to draw but Blender imports it as one character at rest, `flatten` is one layer for readers that compose nothing, such as three.js. */
        instancing: "references" | "scenegraph" | "flatten";
        /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
        level: components["schemas"]["LevelNumber"];
        /**
         * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
         *     somebody who was never seen. A model that names none has no answer for any name.
         * @example tall
         */
        performer: string;
    };
    requestBodies: {
        /** @description By default at most 32 MiB and 100,000 characters. */
        CrowdQuestion: {
            content: {
                "application/json": components["schemas"]["CrowdQuestion"];
            };
        };
        /** @description By default at most 8 MiB, 10,000 clips, 1,000,000 frames in all, and targets of a cost of 2,000 in all: a target counts as one, as four where the clip leaves controls open, and pinned feet as four. */
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
        /** @description How to ask - `Bearer`, and what is wrong with what was sent (RFC 6750). */
        Challenge: string;
        /** @description The request's id, also `instance` of a problem. */
        RequestId: string;
        /** @description The methods this path takes. */
        Allow: string;
        /**
         * @description Strong entity tag: it names these bytes, follows from the model's file and the request alone, and
         *     costs nothing to compare. Send it back in If-None-Match.
         */
        ETag: string;
        /** @description Answers under `name@hash` are immutable; under a name they have to be asked for again, if the service is not told otherwise; everything else is not to be stored. */
        CacheControl: string;
        /** @description To be kept by everybody, and to be asked for again. */
        PageCacheControl: "public, no-cache";
        /** @description The page may load nothing from elsewhere; its own styles and scripts are named by their digests. */
        PagePolicy: string;
        /** @description What this problem means, on the page of problems. */
        Help: string;
        /** @description Headers of the request that the answer depends on. */
        Vary: string;
        /** @description Seconds after which to ask again. */
        RetryAfter: number;
        /** @description A file name for the clip, from the model's name. */
        Disposition: string;
        /** @description A file name from the model's name; absent where the answer is JSON. */
        OwnDisposition: string;
        /** @description Which model answered, as name@hash. */
        Model: components["schemas"]["Identity"];
        /** @description As `sigma` in Trust, metres. */
        Sigma: number;
        /** @description As `duration` in Trust, seconds. */
        Duration: number;
        /**
         * @description Values of the controls that were left out, and are the most typical for those that were given: a JSON
         *     object in ASCII; absent where none was. Since 2.2.0.
         */
        Inferred: string;
        /** @description As `supported` in Trust; always there since 2.2.0. */
        Supported: "true" | "false";
        /**
         * @description One header line for each warning; absent without warnings. Each is a JSON string in ASCII, so
         *     that the lines joined by commas and put in brackets are a JSON array.
         */
        Warning: string;
        /**
         * @description One header line for each of `targets` in Trust that is not reached; absent where all are. Each
         *     is a JSON object in ASCII with `what`, `miss` and `unit`, so that the lines joined by commas and
         *     put in brackets are a JSON array.
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
            /** @description The models this service answers for. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
    getPose: {
        parameters: {
            query: {
                /**
                 * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
                 *     The model's card gives their names, units and sampled ranges; a value outside the range is
                 *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
                 *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
                 *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
                 *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
                 *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /**
                 * @description Seconds from the start of the clip, up to its duration. Repeated for several poses.
                 * @example [
                 *       0,
                 *       0.5
                 *     ]
                 */
                time: components["parameters"]["time"];
                /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /** @description Whether the trust says how far each joint may err. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that
                 *     the model can measure on a motion), `none`, or names of controls with commas between.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description A joint that is to be in its place at a moment, JOINT@MOMENT:X,Y,Z. See the schema Target: the
                 *     moment is its `at`, or its `time` in seconds. Repeated for several.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet that stand stay where they stand. */
                pin_feet?: components["parameters"]["pinFeet"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                 * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
                 *     The model's card gives their names, units and sampled ranges; a value outside the range is
                 *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
                 *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
                 *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
                 *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
                 *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /**
                 * @description Seconds from the start of the clip, up to its duration. Repeated for several poses.
                 * @example [
                 *       0,
                 *       0.5
                 *     ]
                 */
                time: components["parameters"]["time"];
                /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /** @description Whether the trust says how far each joint may err. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that
                 *     the model can measure on a motion), `none`, or names of controls with commas between.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description A joint that is to be in its place at a moment, JOINT@MOMENT:X,Y,Z. See the schema Target: the
                 *     moment is its `at`, or its `time` in seconds. Repeated for several.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet that stand stay where they stand. */
                pin_feet?: components["parameters"]["pinFeet"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                 * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
                 *     The model's card gives their names, units and sampled ranges; a value outside the range is
                 *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
                 *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
                 *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
                 *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
                 *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description Frames a second. A clip has at most 10,000 frames. */
                fps?: components["parameters"]["fps"];
                /** @description Seconds from the start of the whole clip to the first frame. */
                start?: components["parameters"]["start"];
                /** @description Seconds from the start of the whole clip that the last frame does not pass; by default its duration. */
                end?: components["parameters"]["end"];
                /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /** @description Whether the trust says how far each joint may err. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /** @description What joints are called. */
                names?: components["parameters"]["names"];
                /** @description Whether the root travels. */
                root?: components["parameters"]["root"];
                /** @description Whether the clip is a loop. */
                loop?: components["parameters"]["loop"];
                /**
                 * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that
                 *     the model can measure on a motion), `none`, or names of controls with commas between.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description A joint that is to be in its place at a moment, JOINT@MOMENT:X,Y,Z. See the schema Target: the
                 *     moment is its `at`, or its `time` in seconds. Repeated for several.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet that stand stay where they stand. */
                pin_feet?: components["parameters"]["pinFeet"];
                /** @description The file's unit of length; the format's usual one, if left out. glTF has no other than `m`. */
                unit?: components["parameters"]["unit"];
                /** @description The axis that is up in the file; the format's usual one, if left out. Where it is Z a character that faces straight ahead faces -Y. In glTF no other than `y` is up. */
                up?: components["parameters"]["up"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                 * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
                 *     The model's card gives their names, units and sampled ranges; a value outside the range is
                 *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
                 *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
                 *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
                 *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
                 *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description Frames a second. A clip has at most 10,000 frames. */
                fps?: components["parameters"]["fps"];
                /** @description Seconds from the start of the whole clip to the first frame. */
                start?: components["parameters"]["start"];
                /** @description Seconds from the start of the whole clip that the last frame does not pass; by default its duration. */
                end?: components["parameters"]["end"];
                /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
                /** @description Whether the trust says how far each joint may err. */
                joint_sigma?: components["parameters"]["jointSigma"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /** @description What joints are called. */
                names?: components["parameters"]["names"];
                /** @description Whether the root travels. */
                root?: components["parameters"]["root"];
                /** @description Whether the clip is a loop. */
                loop?: components["parameters"]["loop"];
                /**
                 * @description Which measured controls the motion meets exactly: `auto` (of those that were given all that
                 *     the model can measure on a motion), `none`, or names of controls with commas between.
                 * @example none
                 */
                exact?: components["parameters"]["exact"];
                /**
                 * @description A joint that is to be in its place at a moment, JOINT@MOMENT:X,Y,Z. See the schema Target: the
                 *     moment is its `at`, or its `time` in seconds. Repeated for several.
                 * @example [
                 *       "RightHand@end:0.3,1.2,0.4"
                 *     ]
                 */
                target?: components["parameters"]["target"];
                /** @description Whether feet that stand stay where they stand. */
                pin_feet?: components["parameters"]["pinFeet"];
                /** @description The file's unit of length; the format's usual one, if left out. glTF has no other than `m`. */
                unit?: components["parameters"]["unit"];
                /** @description The axis that is up in the file; the format's usual one, if left out. Where it is Z a character that faces straight ahead faces -Y. In glTF no other than `y` is up. */
                up?: components["parameters"]["up"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description Extension of the file: USD text, binary USD, a USDZ package, JSON, BVH, glTF, NumPy arrays, an Arrow stream or MessagePack.
                 * @example usda
                 */
                format: components["parameters"]["clipFormat"];
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
                 * @description A model's name, or name@hash.
                 * @example reach
                 */
                model: components["parameters"]["model"];
                /**
                 * @description Extension of the file: USD text, binary USD, a USDZ package, JSON, BVH, glTF, NumPy arrays, an Arrow stream or MessagePack.
                 * @example usda
                 */
                format: components["parameters"]["clipFormat"];
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
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                /** @description Characters. */
                count?: components["parameters"]["count"];
                /** @description How many different motions they share; left out, each character has its own. Not with a camera. */
                motions?: components["parameters"]["motions"];
                /** @description How long they walk. */
                seconds?: components["parameters"]["seconds"];
                /** @description Frames a second. */
                fps?: components["parameters"]["crowdFps"];
                /** @description Of all that is random. */
                seed?: components["parameters"]["seed"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Where one looks from, x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest, where none does; a switch takes a quarter of a second. It may stand in nobody.
                 * @example 30,1.7,-60
                 */
                camera?: components["parameters"]["camera"];
                /** @description With a camera, its vertical field of view, rad; 60 degrees, if left out. */
                fov?: components["parameters"]["fov"];
                /** @description With a camera, the height of the image, pixels; 1080, if left out. */
                height?: components["parameters"]["height"];
                /** @description With a camera, how many pixels the error of a level may cover; 1, if left out. */
                pixels?: components["parameters"]["pixels"];
                /** @description What characters share. `references` opens in everything that composes layers, `scenegraph` is least to draw but Blender imports it as one character at rest, `flatten` is one layer for readers that compose nothing, such as three.js. */
                instancing?: components["parameters"]["instancing"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                /** @description Characters. */
                count?: components["parameters"]["count"];
                /** @description How many different motions they share; left out, each character has its own. Not with a camera. */
                motions?: components["parameters"]["motions"];
                /** @description How long they walk. */
                seconds?: components["parameters"]["seconds"];
                /** @description Frames a second. */
                fps?: components["parameters"]["crowdFps"];
                /** @description Of all that is random. */
                seed?: components["parameters"]["seed"];
                /** @description Level of detail, of the `levels` on the model's card; 0 is the finest. */
                level?: components["parameters"]["level"];
                /**
                 * @description Where one looks from, x,y,z in metres. Each pose then has the coarsest level of detail whose error covers at most `pixels` pixels, or the finest, where none does; a switch takes a quarter of a second. It may stand in nobody.
                 * @example 30,1.7,-60
                 */
                camera?: components["parameters"]["camera"];
                /** @description With a camera, its vertical field of view, rad; 60 degrees, if left out. */
                fov?: components["parameters"]["fov"];
                /** @description With a camera, the height of the image, pixels; 1080, if left out. */
                height?: components["parameters"]["height"];
                /** @description With a camera, how many pixels the error of a level may cover; 1, if left out. */
                pixels?: components["parameters"]["pixels"];
                /** @description What characters share. `references` opens in everything that composes layers, `scenegraph` is least to draw but Blender imports it as one character at rest, `flatten` is one layer for readers that compose nothing, such as three.js. */
                instancing?: components["parameters"]["instancing"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
    getWhy: {
        parameters: {
            query?: {
                /**
                 * @description One query parameter for each control of the model, named after it: `?stature=1.72&turn=20`.
                 *     The model's card gives their names, units and sampled ranges; a value outside the range is
                 *     answered with a warning (see `extrapolate`), up to a hundred times the width of the range away.
                 *     Controls that are left out (since 2.2.0) are the most typical for those that are given and for the
                 *     performer, where one is named: the mean of the captured clips under these conditions, of a control with
                 *     few sampled values the nearest of those. The answer's trust names them as `inferred`; asked for with
                 *     the values that it gives, and with `exact` naming those that were given (or none), the same answer comes. The names of the other parameters are reserved.
                 * @example {
                 *       "stature": 1.72,
                 *       "hip_height": 0.9,
                 *       "turn": 20,
                 *       "target_height": 1.1
                 *     }
                 */
                controls?: components["parameters"]["controls"];
                /** @description How many captured clips are listed at most, the nearest first. */
                nearest?: components["parameters"]["nearest"];
                /** @description What to do with controls like which nothing was captured and targets out of reach - answer, answer with warnings, or refuse. */
                extrapolate?: components["parameters"]["extrapolate"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                /** @description How many points. */
                count?: components["parameters"]["suggestions"];
                /**
                 * @description Whose clips alone count as captured, of the `performers` that the model's card names; everybody's, if left out.
                 * @example tall
                 */
                performer?: components["parameters"]["whose"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description The control that changes from column to column.
                 * @example turn
                 */
                across: components["parameters"]["across"];
                /**
                 * @description Another control, which changes from row to row.
                 * @example target_height
                 */
                along: components["parameters"]["along"];
                /** @description Values of `across`, evenly from the least that was sampled to the greatest. */
                columns?: components["parameters"]["columns"];
                /** @description Values of `along`. By default at most 65,536 points in all. */
                rows?: components["parameters"]["rows"];
                /** @description Share of a control's sampled range by which the grid goes beyond it on either side. */
                margin?: components["parameters"]["margin"];
                /** @description One parameter for each other control that is not at its default. */
                controls?: components["parameters"]["fixedControls"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
                 * @description The control that changes from column to column.
                 * @example turn
                 */
                across: components["parameters"]["across"];
                /**
                 * @description Another control, which changes from row to row.
                 * @example target_height
                 */
                along: components["parameters"]["along"];
                /** @description Values of `across`, evenly from the least that was sampled to the greatest. */
                columns?: components["parameters"]["columns"];
                /** @description Values of `along`. By default at most 65,536 points in all. */
                rows?: components["parameters"]["rows"];
                /** @description Share of a control's sampled range by which the grid goes beyond it on either side. */
                margin?: components["parameters"]["margin"];
                /** @description One parameter for each other control that is not at its default. */
                controls?: components["parameters"]["fixedControls"];
                /**
                 * @description Who moves, of the `performers` that the model's card names. Left out, the answer is for
                 *     somebody who was never seen. A model that names none has no answer for any name.
                 * @example tall
                 */
                performer?: components["parameters"]["performer"];
            };
            header?: {
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
                "If-None-Match"?: components["parameters"]["ifNoneMatch"];
            };
            path: {
                /**
                 * @description A model's name, or name@hash.
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
                 * @description A model's name, or name@hash.
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
            /** @description It does. */
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
            /** @description They do. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
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
                /** @description Entity tags of answers that the client has. Where one is the answer's, 304 comes instead of it. */
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
export const CONTRACT = "3.0.0";

/** Keys that every document has. */
export const REQUIRED = {
  "ManifestEntry": [
    "name",
    "file",
    "bytes",
    "sha256",
    "frames",
    "fps",
    "model",
    "controls",
    "performer",
    "level",
    "duration",
    "sigma",
    "warnings"
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

/** Which of them are lists. */
export const LISTS = {
  "ManifestEntry": [
    "warnings"
  ],
  "ModelCard": [
    "controls",
    "levels",
    "durations",
    "performers",
    "examples",
    "moved_by",
    "feet",
    "sources"
  ],
  "ModelList": [
    "models"
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

/** What files of each format are sent as. */
export const MEDIA_TYPES = {
  "usda": "model/vnd.usda",
  "usdc": "model/vnd.usdc",
  "usdz": "model/vnd.usdz+zip",
  "json": "application/json",
  "bvh": "application/x-bvh",
  "glb": "model/gltf-binary",
  "npz": "application/x-npz",
  "arrow": "application/vnd.apache.arrow.stream",
  "msgpack": "application/vnd.msgpack",
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
