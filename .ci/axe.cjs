// Accessibility of a page by axe-core, on a wide and on a narrow screen: node axe.cjs PAGE.html...
// Needs npm install axe-core playwright-core in a folder of NODE_PATH, and Chromium. Fails on serious findings.
const { source } = require("axe-core");
const { chromium } = require("playwright-core");
const { resolve } = require("path");

(async () => {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox"] });
  let serious = 0;
  for (const file of process.argv.slice(2)) {
    for (const [width, height] of [[1400, 900], [390, 844]]) {
      const page = await (await browser.newContext({ viewport: { width, height }, bypassCSP: true })).newPage();
      await page.goto(`file://${resolve(file)}`);
      await page.evaluate(source);
      const { violations } = await page.evaluate(() => {
        for (const part of document.querySelectorAll("details")) part.open = true;
        return axe.run();
      });
      for (const { id, impact, help, nodes } of violations) console.log(`${file} ${width}: ${impact}: ${id}: ${help} (${nodes.length}; ${nodes[0].target})`);
      serious += violations.filter(({ impact }) => ["serious", "critical"].includes(impact)).length;
    }
  }
  console.log(`axe-core: ${serious} serious or critical findings`);
  await browser.close();
  process.exit(serious ? 1 : 0);
})();
