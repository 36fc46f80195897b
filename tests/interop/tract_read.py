"""Answer of a model file in tract: python tract_read.py MODEL QUESTION RESULT (both .npz)."""

import sys

import numpy as np
import tract

path, question, result = sys.argv[1:]
with np.load(question) as found:
    asked = {name: found[name] for name in found.files}
model = tract.onnx().load(path)
names = [model.input_name(index) for index in range(model.input_count())]
for index, name in enumerate(names):
    shape = ",".join(map(str, asked[name].shape))
    model.set_input_fact(index, f"{shape},f32")
outputs = [model.output_name(index) for index in range(model.output_count())]
model.analyse()
answers = model.into_model().into_runnable().run([asked[name] for name in names])
np.savez(result, **{n: a.to_numpy() for n, a in zip(outputs, answers, strict=True)})
