// Drives the page of `rig live` in headless Chromium, as a user would. See CONTRIBUTING.md.
//
//   node page.js RIG [--minutes N] [--pictures FOLDER]
//
// RIG is the program. With --minutes a motion runs again and again while the page and a recording count the samples.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import { chromium } from "playwright-core";

const option = name => { const at = process.argv.indexOf(name); return at < 0 ? undefined : process.argv[at + 1]; };
const rig = resolve(process.argv[2] || "target/release/rig");
const minutes = Number(option("--minutes") || 0), pictures = option("--pictures");
const folder = mkdtempSync(join(tmpdir(), "rig-live-"));
const file = name => join(folder, name);

execFileSync(rig, ["init", "one-link", "--out", file("rig.toml")]);
execFileSync(rig, ["excite", "--robot", file("rig.toml"), "--start", "-1.5708", "--out", file("motion.toml")]);
const server = spawn(rig, ["live", "--emulated", "--robot", file("rig.toml"), "--listen", "127.0.0.1:0", "--out", folder],
  { stdio: ["ignore", "pipe", "inherit"] });
const lines = createInterface(server.stdout);
const url = await new Promise(found => lines.once("line", line => found(line.match(/http:\/\/\S+/)[0])));
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox", "--disable-dev-shm-usage"] });

async function open(width, height, colorScheme) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme, acceptDownloads: true });
  const page = await context.newPage();
  page.on("pageerror", error => { throw error; });
  page.on("request", request => assert.ok(request.url().startsWith(url) || /^(data|blob):/.test(request.url()), request.url()));
  await page.goto(url);
  await mode(page, "disarmed");
  return page;
}
const mode = (page, wanted) => page.waitForFunction(m => rigLive.status && rigLive.status.mode === m, wanted, { timeout: 60000 });
const said = (page, text) => page.waitForFunction(t => document.getElementById("message-text").textContent.includes(t), text, { timeout: 20000 });
const picture = (page, name) => pictures ? page.screenshot({ path: join(pictures, name + ".png") }) : undefined;
async function start(page) {
  await page.click("#start");
  await page.waitForFunction(() => rigLive.status.mode === "running" || !document.getElementById("shifted").hidden);
  if (await page.isVisible("#shifted")) await page.click("#shifted");
  await mode(page, "running");
}

async function asUser(width, height, scheme) {
  const page = await open(width, height, scheme);
  await page.setInputFiles("#file", { name: "wrong.toml", mimeType: "text/plain", buffer: Buffer.from("joint = 3") });
  await said(page, "wrong.toml:1:9");
  await page.setInputFiles("#file", file("motion.toml"));
  await said(page, "motion.toml is loaded");
  await page.focus("#arm");
  await page.keyboard.press("Enter");
  await mode(page, "holding");
  await start(page);
  await page.waitForTimeout(5000);
  await picture(page, `running-${width}-${scheme}`);
  // Two cursors a second or more apart, read in the table.
  const over = page.locator(".u-over").first(), box = await over.boundingBox();
  await page.keyboard.press("p");
  await over.click({ position: { x: 0.6 * box.width, y: 20 } });
  await page.keyboard.press("b");
  await page.keyboard.press("Shift+ArrowRight");
  // The page writes them a few times a second.
  await page.waitForFunction(() => [...document.querySelector("#cursor-rows tr").children].slice(1)
    .every(cell => cell.textContent && Number.isFinite(Number(cell.textContent))), undefined, { timeout: 20000 });
  await picture(page, `cursors-${width}-${scheme}`);
  const download = page.waitForEvent("download");
  await page.click("#save-csv");
  const rows = readFileSync(await (await download).path(), "utf8").trim().split("\n");
  assert.equal(rows[0], "t,q1,i1,u1,ref1,qd1,tau_cmd1,limits,mode");
  assert.ok(rows.length > 3000, `${rows.length} rows`);
  await page.keyboard.press("c");
  await page.keyboard.press("0");
  // Space stops although a button has the focus.
  await page.focus("#record");
  await page.keyboard.press("Space");
  await mode(page, "disarmed");
  await page.waitForFunction(() => document.getElementById("stop-state").textContent.includes("bridge is off"));
  assert.equal(await page.evaluate(() => rigLive.status.recording), null);
  await picture(page, `stopped-${width}-${scheme}`);
  const counts = await page.evaluate(() => ({ ...rigLive, wide: document.documentElement.scrollWidth - innerWidth }));
  assert.ok(counts.wide <= 0 && counts.missed === 0 && counts.unordered === 0, JSON.stringify(counts));
  console.log(`${width} px, ${scheme}: ${await page.textContent("#stop-state")}`);
  await page.context().close();
}

async function endure() {
  const page = await open(1280, 900, "light");
  await page.setInputFiles("#file", file("motion.toml"));
  await said(page, "is loaded");
  await page.click("#record");
  await said(page, "Recording to");
  await page.click("#arm");
  await mode(page, "holding");
  const end = Date.now() + minutes * 60000;
  while (Date.now() < end) {
    if (await page.evaluate(() => rigLive.status.mode === "holding")) await start(page);
    await page.waitForTimeout(1000);
  }
  await page.click("#record");
  await said(page, "missing");
  console.log(await page.textContent("#message-text"));
  const times = readFileSync(file("live-1.csv"), "utf8").trim().split("\n").slice(1).map(line => Number(line.split(",")[0]));
  for (let k = 1; k < times.length; k++) assert.ok(Math.abs(times[k] - times[k - 1] - 1e-3) < 1e-7, `step at ${times[k]} s`);
  await page.waitForTimeout(500);
  const seen = await page.evaluate(([a, b]) => ({ samples: rigLive.ring.find(b + 1e-6) - rigLive.ring.find(a - 1e-6), missed: rigLive.missed,
    draws: rigLive.draws, mean: rigLive.drawTime / rigLive.draws, worst: rigLive.worstDraw }), [times[0], times[times.length - 1]]);
  console.log(`recorded ${times.length}, on the page ${seen.samples}, missed ${seen.missed}; ${seen.draws} pictures, ${seen.mean.toFixed(1)} ms each, ${seen.worst.toFixed(0)} ms the longest`);
  assert.equal(seen.samples, times.length);
  await page.keyboard.press("Escape");
  await mode(page, "disarmed");
}

try {
  if (minutes > 0) await endure();
  else {
    await asUser(1280, 900, "light");
    await asUser(360, 740, "dark");
    await asUser(1280, 900, "dark");
    await asUser(360, 740, "light");
  }
} finally {
  await browser.close();
  server.kill("SIGINT");
  await new Promise(done => server.once("exit", done));
  rmSync(folder, { recursive: true });
}
