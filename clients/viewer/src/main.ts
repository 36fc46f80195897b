import "./style.css";
import { App } from "./app.ts";
import * as theme from "./theme.ts";

theme.start();
void new App().start();
