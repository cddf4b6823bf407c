// Pages as they are: no template language in them, anchors as GitHub makes them, Mermaid drawn in the reader's browser.
const slug = (heading) => heading.trim().toLowerCase().replace(/[^\p{L}\p{N}_\- ]/gu, "").replaceAll(" ", "-");

function text_of(inline) {
  return inline.children.map((part) => (part.type === "text" || part.type === "code_inline" ? part.content : "")).join("");
}

function with_anchors(md) {
  md.core.ruler.push("anchors", ({ tokens }) => {
    const seen = new Set();
    tokens.forEach((token, k) => {
      if (token.type !== "heading_open") return;
      const base = slug(text_of(tokens[k + 1]));
      let name = base;
      for (let count = 1; seen.has(name); ++count) name = `${base}-${count}`;
      seen.add(name);
      token.attrSet("id", name);
    });
  });
}

function with_diagrams(md) {
  const fence = md.renderer.rules.fence;
  md.renderer.rules.fence = (tokens, k, ...rest) => tokens[k].info.trim() === "mermaid"
    ? `<pre class="mermaid">${md.utils.escapeHtml(tokens[k].content)}</pre>` : fence(tokens, k, ...rest);
}

export default function (config) {
  config.amendLibrary("md", (md) => { with_anchors(md); with_diagrams(md); });
  config.addGlobalData("layout", "page.njk");
  config.addGlobalData("permalink", () => ({ page }) => `${page.filePathStem}.html`);
  // From a page to a path of the site: links are relative, so the site may lie anywhere.
  config.addFilter("from", (path, stem) => "../".repeat(stem.split("/").length - 2) + path);
  config.addFilter("title", (content) => content.match(/<h1[^>]*>(.*?)<\/h1>/s)?.[1].replace(/<[^>]*>/g, "") ?? "Cordillera");
  return { dir: { input: "pages", output: process.env.ELEVENTY_OUTPUT, includes: "_includes", data: "_data" }, markdownTemplateEngine: false };
}
