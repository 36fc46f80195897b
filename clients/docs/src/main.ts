/** The page at `/docs`: the service's contract in Swagger UI. */

import SwaggerUI from "swagger-ui";
import "swagger-ui/dist/swagger-ui.css";
import "./page.css";

import { foldDescription, type JsonObject, type Model, withExamples } from "./document.ts";
import { nameFields } from "./fields.ts";
import { addSamples } from "./samples.ts";
import { filtered } from "./search.ts";

const dark = matchMedia("(prefers-color-scheme: dark)");

function showScheme(): void {
  document.documentElement.classList.toggle("dark-mode", dark.matches);
}

async function fetched<T>(path: string): Promise<T | undefined> {
  const answer = await fetch(path);
  return answer.ok ? ((await answer.json()) as T) : undefined;
}

/** The first model that this service has; none where it has none, or asks for a key. */
async function firstModel(): Promise<Model | undefined> {
  const list = await fetched<{ readonly models: readonly { readonly name: string }[] }>(
    "/v1/models",
  );
  const name = list?.models[0]?.name;
  return name === undefined ? undefined : fetched<Model>(`/v1/models/${name}`);
}

async function show(): Promise<void> {
  const [contract, model] = await Promise.all([fetched<JsonObject>("/openapi.json"), firstModel()]);
  if (!contract) throw new Error("/openapi.json was refused");
  const document = withExamples(contract, model);
  foldDescription(document);
  addSamples(document, location.origin);
  SwaggerUI({
    spec: document,
    dom_id: "#contract",
    deepLinking: true,
    filter: true,
    tryItOutEnabled: true,
    docExpansion: "list",
    defaultModelsExpandDepth: 0,
    displayRequestDuration: true,
    // A clip as JSON is a megabyte, and colouring it stops the page for minutes.
    syntaxHighlight: false,
    // Otherwise it asks a service of its maker's.
    validatorUrl: null,
    plugins: [{ fn: { opsFilter: filtered } }],
  });
}

dark.addEventListener("change", showScheme);
showScheme();
nameFields(document.getElementById("contract")!);
show().catch((fault: unknown) => {
  document.getElementById("contract")!.textContent = `The contract cannot be shown: ${fault}`;
});
