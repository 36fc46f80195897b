/* Prints a pose of a posefield model, evaluated by onnxruntime: no service, no Python.
 *
 *     posefield-pose MODEL.onnx TIME [CONTROL=VALUE ...]
 *
 * Controls that are left out have their defaults. Each line has a joint's name and its place, m,
 * Y up. Feet are as predicted: standing feet and exact controls are the service's. The card of a
 * model is JSON in its metadata; a program that has a JSON reader uses that instead of `after`.
 */
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "onnxruntime_c_api.h"

#define MOST 256 /* controls or joints */

static const OrtApi *ort;

static void fail(const char *format, ...) {
    va_list values;
    va_start(values, format);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
    exit(1);
}

static void check(OrtStatus *status) {
    if (status != NULL) fail("%s", ort->GetErrorMessage(status));
}

/* The text behind a key of JSON; the keys of the card's parts do not occur in their values. */
static const char *after(const char *json, const char *key) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *place = strstr(json, quoted);
    return place == NULL ? NULL : place + strlen(quoted);
}

/* The strings of a list, which end up in place, or of one string; gives the number of them. */
static int strings(char *json, char *names[]) {
    int count = 0;
    for (char *end = json; *end != ']' && count < MOST; end++) {
        if (*end != '"') continue;
        names[count++] = ++end;
        end = strchr(end, '"');
        *end = '\0';
    }
    return count;
}

static int controls(const char *json, int pairs, char **pair, float values[]) {
    int count = 0, used = 0;
    while ((json = after(json, "default")) != NULL && count < MOST) {
        values[count] = strtof(json, NULL);
        const char *name = after(json, "name");
        size_t length = strcspn(++name, "\"");
        for (int i = 0; i < pairs; i++) {
            if (strncmp(pair[i], name, length) != 0 || pair[i][length] != '=') continue;
            values[count] = strtof(pair[i] + length + 1, NULL);
            used++;
        }
        count++;
    }
    if (used != pairs) fail("%d controls, of which the model has %d", pairs, used);
    return count;
}

/* Product of quaternions w x y z. */
static void product(const float a[4], const float b[4], float result[4]) {
    result[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    result[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    result[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    result[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

/* Vector turned by a unit quaternion; the first number of both vectors is unused. */
static void turned(const float q[4], const float v[4], float result[4]) {
    const float back[4] = {q[0], -q[1], -q[2], -q[3]};
    float half[4];
    product(q, v, half);
    product(half, back, result);
}

int main(int argc, char **argv) {
    if (argc < 3) fail("expected MODEL.onnx TIME [CONTROL=VALUE ...]");
    ort = OrtGetApiBase()->GetApi(ORT_API_VERSION);
    if (ort == NULL) fail("the library is older than the header, %d", ORT_API_VERSION);
    OrtEnv *env;
    OrtSessionOptions *options;
    OrtSession *session;
    check(ort->CreateEnv(ORT_LOGGING_LEVEL_ERROR, "posefield", &env));
    check(ort->DisableTelemetryEvents(env));
    check(ort->CreateSessionOptions(&options));
    check(ort->CreateSession(env, argv[1], options, &session)); /* a wide string on Windows */

    OrtModelMetadata *metadata;
    OrtAllocator *allocator;
    char *card[2];
    const char *keys[] = {"posefield.controls", "posefield.skeleton"};
    check(ort->SessionGetModelMetadata(session, &metadata));
    check(ort->GetAllocatorWithDefaultOptions(&allocator));
    for (int i = 0; i < 2; i++) {
        check(ort->ModelMetadataLookupCustomMetadataMap(metadata, allocator, keys[i], &card[i]));
        if (card[i] == NULL) fail("no model of posefield");
    }
    float values[MOST], time = strtof(argv[2], NULL), *output[3];
    int64_t shape[] = {1, controls(card[0], argc - 3, argv + 3, values)}, one[] = {1, 1};

    OrtMemoryInfo *memory;
    OrtValue *inputs[2], *outputs[3] = {NULL};
    const char *in[] = {"controls", "time"};
    const char *out[] = {"rotations", "root_position", "bone_offsets"};
    const ONNXTensorElementDataType type = ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT;
    size_t bytes = shape[1] * sizeof(float);
    check(ort->CreateCpuMemoryInfo(OrtArenaAllocator, OrtMemTypeDefault, &memory));
    check(ort->CreateTensorWithDataAsOrtValue(memory, values, bytes, shape, 2, type, &inputs[0]));
    check(ort->CreateTensorWithDataAsOrtValue(memory, &time, 4, one, 2, type, &inputs[1]));
    check(ort->Run(session, NULL, in, (const OrtValue *const *)inputs, 2, out, 3, outputs));
    for (int i = 0; i < 3; i++) check(ort->GetTensorMutableData(outputs[i], (void **)&output[i]));

    char *names[MOST], *parent = (char *)after(card[1], "parents");
    float turns[MOST][4], places[MOST][4];
    int joints = strings((char *)after(card[1], "names"), names);
    for (int joint = 0; joint < joints; joint++) {
        int above = (int)strtol(parent + 1, &parent, 10); /* parents come before their children */
        const float *turn = output[0] + 4 * joint, *bone = output[above < 0 ? 1 : 2];
        if (above >= 0) bone += 3 * joint;
        const float offset[4] = {0, bone[0], bone[1], bone[2]};
        if (above < 0) {
            memcpy(turns[joint], turn, sizeof turns[joint]);
            memcpy(places[joint], offset, sizeof offset);
        } else {
            product(turns[above], turn, turns[joint]);
            turned(turns[above], offset, places[joint]);
            for (int axis = 1; axis < 4; axis++) places[joint][axis] += places[above][axis];
        }
        const float *place = places[joint];
        printf("%s %.9g %.9g %.9g\n", names[joint], place[1], place[2], place[3]);
    }
    return 0; /* the system takes back all memory */
}
