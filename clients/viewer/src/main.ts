import "./style.css";
import { App } from "./app.ts";
import * as theme from "./theme.ts";

theme.start();
new App().start();
