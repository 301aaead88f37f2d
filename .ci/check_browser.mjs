// Opens a report in headless Chromium, wide and narrow, and checks that it is drawn, fits and complains of nothing:
// `node check_browser.mjs report.html [FOLDER FOR PICTURES]`. It speaks the DevTools protocol through a pipe.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [page, pictures] = process.argv.slice(2);
const address = pathToFileURL(resolve(page)).href;
const profile = mkdtempSync(join(tmpdir(), "chromium-"));
const chromium = spawn("chromium", [
  "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-dev-shm-usage",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
  `--user-data-dir=${profile}`, "--remote-debugging-pipe", "about:blank",
], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const [to, from] = [chromium.stdio[3], chromium.stdio[4]];

const waiting = new Map();
const heard = [];
let number = 0;
let rest = "";
from.setEncoding("utf8");
from.on("data", (text) => {
  const messages = (rest + text).split("\0");
  rest = messages.pop();
  for (const message of messages.map((one) => JSON.parse(one))) {
    const answer = waiting.get(message.id);
    if (!answer) { heard.push(message); continue; }
    waiting.delete(message.id);
    if (message.error) answer.reject(new Error(message.error.message));
    else answer.resolve(message.result);
  }
});
to.on("error", () => {});
const fail = (error) => waiting.forEach(({ reject }) => reject(error));
chromium.on("error", fail);
chromium.on("exit", (code) => fail(new Error(`chromium ended with code ${code}`)));

function send(method, params = {}, sessionId = undefined) {
  number += 1;
  const id = number;
  to.write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

// How much is drawn on the page as it stands, and whether it fits a window of that width.
const look = (width) => `(() => {
  const shown = [...document.querySelectorAll(".plot")].filter((box) => box.offsetParent !== null);
  const drawn = shown.filter((box) => {
    const svg = box.querySelector("svg.main-svg");
    return svg && svg.getBoundingClientRect().height > 50 && box.querySelector(".trace path, .trace rect, .points path, canvas");
  });
  const covers = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const boxes = (box, what) => [...box.querySelectorAll(what)].map((part) => part.getBoundingClientRect());
  const covered = drawn.filter((box) => boxes(box, ".modebar-group").some((tools) => boxes(box, ".legend, .nsewdrag").some((part) => covers(tools, part))));
  return {
    covered: covered.map((box) => box.id),
    marked: document.documentElement.dataset.drawn === "yes",
    shown: shown.length,
    drawn: drawn.length,
    missing: shown.filter((box) => !drawn.includes(box)).map((box) => box.id),
    wide: document.documentElement.scrollWidth,
    window: Math.min(${width}, document.documentElement.clientWidth),
    buttons: document.querySelectorAll("#steps [data-step]").length,
  };
})()`;

async function check(width, height, mobile) {
  const problems = [];
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const here = (method, params) => send(method, params, sessionId);
  const evaluate = async (expression) => {
    const { result, exceptionDetails } = await here("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  };
  for (const domain of ["Page", "Runtime", "Log", "Network"]) await here(`${domain}.enable`);
  await here("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile });
  await here("Page.navigate", { url: address });

  let seen = {};
  for (let waited = 0; waited < 60_000 && !seen.marked; waited += 200) {
    await pause(200);
    seen = await evaluate(look(width));
  }
  if (!seen.marked) problems.push("the plots are not drawn after a minute");
  // Every model of the trail in turn.
  for (let k = 0; k < seen.buttons; k += 1) {
    await evaluate(`document.querySelector('#steps [data-step="${k}"]').click()`);
    await pause(300);
    seen = await evaluate(look(width));
    if (seen.missing.length) problems.push(`model ${k}: not drawn: ${seen.missing.join(", ")}`);
    if (seen.wide > seen.window) problems.push(`model ${k}: the page is ${seen.wide} px wide in ${seen.window} px`);
  }
  if (seen.shown === 0) problems.push("there is no plot");
  if (seen.missing.length) problems.push(`not drawn: ${seen.missing.join(", ")}`);
  if (seen.covered.length) problems.push(`the tools cover names or curves: ${seen.covered.join(", ")}`);
  if (seen.wide > seen.window) problems.push(`the page is ${seen.wide} px wide in ${seen.window} px`);

  for (const { method, params, sessionId: of } of heard) {
    if (of !== sessionId) continue;
    if (method === "Runtime.exceptionThrown") {
      const details = params.exceptionDetails;
      problems.push(`exception: ${details.exception?.description ?? details.text}`);
    } else if (method === "Runtime.consoleAPICalled" && ["error", "assert", "warning"].includes(params.type)) {
      problems.push(`console ${params.type}: ${params.args.map((one) => one.value ?? one.description).join(" ")}`);
    } else if (method === "Log.entryAdded" && ["error", "warning"].includes(params.entry.level)) {
      problems.push(`log ${params.entry.level}: ${params.entry.text}`);
    } else if (method === "Network.requestWillBeSent" && !/^(data|blob|about):/.test(params.request.url) && params.request.url !== address) {
      problems.push(`it asks for ${params.request.url}`);
    }
  }
  if (pictures) {
    const { data } = await here("Page.captureScreenshot", { format: "png", captureBeyondViewport: true });
    writeFileSync(join(pictures, `${width}.png`), Buffer.from(data, "base64"));
  }
  await send("Target.closeTarget", { targetId });
  console.log(`${width} px: ${seen.drawn} of ${seen.shown} plots drawn, ${seen.buttons} models, page ${seen.wide} px wide`);
  return problems.map((problem) => `${width} px: ${problem}`);
}

let code = 1;
const limit = setTimeout(() => fail(new Error("chromium does not answer")), 240_000);
try {
  const problems = [...await check(1280, 900, false), ...await check(390, 844, true)];
  problems.forEach((problem) => console.error(problem));
  code = problems.length ? 1 : 0;
} catch (error) {
  console.error(`the browser check ended early: ${error.message}`);
} finally {
  clearTimeout(limit);
  const ended = new Promise((done) => (chromium.exitCode === null ? chromium.once("exit", done) : done()));
  await Promise.race([send("Browser.close").catch(() => {}), pause(3000)]);
  await Promise.race([ended, pause(5000).then(() => chromium.kill("SIGKILL"))]);
  rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
}
process.exit(code);
