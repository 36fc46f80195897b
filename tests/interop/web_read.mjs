// Asks a model file in onnxruntime-web, as a browser would: node web_read.mjs NODE_MODULES MODEL QUESTION RESULT
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const [modules, model, question, result] = process.argv.slice(2);
const found = createRequire(`${modules}/`).resolve('onnxruntime-web');
const ort = await import(pathToFileURL(found));
ort.env.wasm.numThreads = 1;
ort.env.logLevel = 'error';

const session = await ort.InferenceSession.create(readFileSync(model), { logSeverityLevel: 3 });
const asked = JSON.parse(readFileSync(question));
const feed = Object.fromEntries(
  Object.entries(asked).map(([name, { shape, data }]) =>
    [name, new ort.Tensor('float32', Float32Array.from(data), shape)]),
);
const answers = await session.run(feed);
const made = Object.fromEntries(
  Object.entries(answers).map(([name, { dims, data }]) => [name, { shape: dims, data: [...data] }]),
);
writeFileSync(result, JSON.stringify(made));
