import "./style.css";
import { App } from "./app.ts";
import * as probe from "./probe/part.ts";
import * as theme from "./theme.ts";

theme.start();
probe.listen();
void new App().start();
