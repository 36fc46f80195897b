//! Prints a pose of a posefield model, evaluated by tract in this process: no service, no Python.
//!
//!     posefield-pose MODEL.onnx TIME [CONTROL=VALUE ...]
//!
//! Controls that are left out have their defaults. Each line has a joint's name and its place, m,
//! Y up. Feet are as predicted: standing feet and exact controls are the service's.

use std::collections::HashMap;
use std::error::Error;

use serde_json::Value;
use tract_onnx::prelude::*;

type Quaternion = [f32; 4];
type Vector = [f32; 3];

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [path, time, pairs @ ..] = &words[..] else {
        return Err("expected MODEL.onnx TIME [CONTROL=VALUE ...]".into());
    };
    let framework = tract_onnx::onnx();
    let proto = framework.proto_model_for_path(path)?;
    let card = |part: &str| -> Result<Value, Box<dyn Error>> {
        let entry = proto.metadata_props.iter().find(|entry| entry.key == part);
        Ok(serde_json::from_str(
            &entry.ok_or("no model of posefield")?.value,
        )?)
    };
    let controls = controls(&card("posefield.controls")?, pairs)?;

    let model = framework
        .model_for_proto_model(&proto)?
        .with_input_fact(0, f32::fact([1, controls.len()]).into())?
        .with_input_fact(1, f32::fact([1, 1]).into())?
        .into_optimized()?
        .into_runnable()?;
    let answer = model.run(tvec!(
        Tensor::from_shape(&[1, controls.len()], &controls)?.into(),
        Tensor::from_shape(&[1, 1], &[time.parse::<f32>()?])?.into(),
    ))?;
    let rotations: Vec<Quaternion> = rows(&answer[0])?;
    let root: Vec<Vector> = rows(&answer[1])?;
    let bones: Vec<Vector> = rows(&answer[2])?;

    let skeleton = card("posefield.skeleton")?;
    let parents: Vec<i64> = list(&skeleton["parents"], Value::as_i64)?;
    let names: Vec<&str> = list(&skeleton["names"], Value::as_str)?;
    let mut poses: Vec<(Quaternion, Vector)> = Vec::new();
    for (joint, &parent) in parents.iter().enumerate() {
        // Parents come before their children.
        let pose = if parent < 0 {
            (rotations[joint], root[0])
        } else {
            let (turn, place) = poses[parent as usize];
            let bone = turned(turn, bones[joint]);
            let end = [place[0] + bone[0], place[1] + bone[1], place[2] + bone[2]];
            (product(turn, rotations[joint]), end)
        };
        println!("{} {} {} {}", names[joint], pose.1[0], pose.1[1], pose.1[2]);
        poses.push(pose);
    }
    Ok(())
}

/// Values of the controls in the order of the card; those without a word have their defaults.
fn controls(list: &Value, pairs: &[String]) -> Result<Vec<f32>, Box<dyn Error>> {
    let mut given = HashMap::new();
    for pair in pairs {
        let (name, value) = pair.split_once('=').ok_or("expected CONTROL=VALUE")?;
        given.insert(name, value.parse::<f32>()?);
    }
    let mut values = Vec::new();
    for control in list.as_array().ok_or("no controls")? {
        let name = control["name"].as_str().ok_or("a control without a name")?;
        let default = control["default"]
            .as_f64()
            .ok_or("a control without a default")?;
        values.push(given.remove(name).unwrap_or(default as f32));
    }
    match given.keys().next() {
        Some(name) => Err(format!("unknown control {name}").into()),
        None => Ok(values),
    }
}

fn list<'a, T>(
    values: &'a Value,
    item: impl Fn(&'a Value) -> Option<T>,
) -> Result<Vec<T>, Box<dyn Error>> {
    let items = values.as_array().ok_or("expected a list")?;
    let all: Option<Vec<T>> = items.iter().map(item).collect();
    all.ok_or_else(|| "expected items of one kind".into())
}

/// Rows of N numbers of a tensor, whatever its other axes.
fn rows<const N: usize>(tensor: &Tensor) -> Result<Vec<[f32; N]>, Box<dyn Error>> {
    let view = tensor.to_plain_array_view::<f32>()?;
    let numbers: Vec<f32> = view.iter().copied().collect();
    Ok(numbers
        .chunks_exact(N)
        .map(|row| row.try_into().unwrap())
        .collect())
}

/// Product of quaternions w x y z.
fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Vector turned by a unit quaternion.
fn turned(q: Quaternion, v: Vector) -> Vector {
    let [_, x, y, z] = product(
        product(q, [0.0, v[0], v[1], v[2]]),
        [q[0], -q[1], -q[2], -q[3]],
    );
    [x, y, z]
}
