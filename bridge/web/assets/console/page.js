// The console of a running bridge: asks it for its picture again and again, and shows the page that is wanted. It changes
// nothing there but what record.js does.
import {$, make} from "/parts.js";
import {Graph, MOST} from "/console/graph.js";
import {History, arrowOf, idsOf, lastText, linkOf, matches, rateText, stateClass, wordsOf} from "/console/picture.js";
import {Limits} from "/console/limits.js";
import {Record} from "/console/record.js";
import {RoutePage} from "/console/route.js";
import {ago, counted, figure, fill, mono, numeric, put, whole} from "/console/text.js";

const EVERY = 1000;  // ms
const ROWS = 50;     // of a page of the list of routes

const page = {
  token: sessionStorage.getItem("token") || "",
  picture: null,
  history: new History(),
  view: "network",
  failed: 0,       // times in a row
  first: 0,        // row of the list of routes
  order: "",       // "": as in the configuration; else a column
  backwards: false,
};

/// @param change  what is to be done; without it only asks
/// @throws Error with what went wrong; its status is 401 where the token is missing or wrong
async function ask(path, change) {
  const headers = page.token ? {Authorization: `Bearer ${page.token}`} : {};
  if (change) headers["Content-Type"] = "application/json";
  const answer = await fetch(path, change ? {method: "POST", headers, body: JSON.stringify(change)} : {headers}).catch(() => {
    throw new Error("the bridge does not answer: has it ended?");
  });
  if (!answer.ok) throw Object.assign(new Error((await answer.text()).trim() || answer.statusText), {status: answer.status});
  return answer;
}

const graph = new Graph($("graph"));
const limits = new Limits($("limits"));
const route = new RoutePage($("route"), ask);
const record = new Record(ask);

// ---- what is shown ----

const VIEWS = ["network", "routes", "limits", "route"];

/// What stands behind "#": a view, and of "route" which one.
function wanted() {
  const [view, key] = location.hash.slice(1).split("/");
  try {
    return {view: VIEWS.includes(view) ? view : "network", key: decodeURIComponent(key || "")};
  } catch {
    return {view: "network", key: ""};  // badly encoded
  }
}

function go() {
  const {view, key} = wanted();
  page.view = view;
  route.choose(view === "route" ? key : "");
  for (const name of VIEWS) $(name).hidden = name !== page.view || !page.picture;
  for (const link of document.querySelectorAll("nav a")) {
    const here = link.hash === `#${page.view}` || (page.view === "route" && link.hash === "#routes");
    if (here) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  show();
}

function show() {
  const {picture} = page;
  if (!picture) return;
  const name = picture.configuration.split("/").pop() || "trestle bridge";
  put($("bridge"), name);
  document.title = `${name} – trestle console`;
  if (page.view === "network") showNetwork(picture);
  else if (page.view === "routes") showRoutes(picture);
  else if (page.view === "limits") limits.show(picture);
  else route.show(picture, page.history);
}

function showNetwork(picture) {
  const words = wordsOf($("graph-filter").value);
  const wanted = picture.routes.filter((one) => matches(one, words));
  const shown = graph.show(wanted, picture);
  const all = counted(picture.routes.length, "route");
  put($("graph-count"), shown < picture.routes.length ? `${shown} of ${all}${wanted.length > MOST ? ", those with a cause first" : ""}` : "");
  const causes = wanted.filter((one) => one.cause.words !== "").slice(0, 2 * MOST);
  const list = $("causes");
  while (list.children.length > Math.max(1, causes.length)) list.lastChild.remove();
  if (causes.length === 0) {
    list.replaceChildren(make("li", {className: "faint", textContent: "Nothing is amiss."}));
    return;
  }
  causes.forEach((one, i) => {
    let item = list.children[i];
    if (!item || !item.querySelector("a")) {
      const made = make("li", {}, make("a"), " ", make("span", {className: "bad"}));
      if (item) item.replaceWith(made);
      else list.append(made);
      item = made;
    }
    item.querySelector("a").href = linkOf(one);
    put(item.querySelector("a"), one.name);
    put(item.querySelector("span"), one.cause.words);
  });
}

// ---- the list of routes: a page of it at a time, so that a thousand cost what fifty do ----

const COLUMNS = [
  {title: "Route", of: (one) => one.name},
  {title: "", of: (one) => one.direction},
  {title: "SOME/IP", of: (one) => idsOf(one)},
  {title: "State", of: (one) => one.state},
  {title: "msg/s", of: (one) => one.per_second},
  {title: "MB/s", of: (one) => one.bytes_per_second},
  {title: "Last", of: (one) => one.last_ns},
  {title: "Lost", of: (one) => lossOf(one)},
  {title: "Why nothing flows", of: (one) => one.cause.words},
];
const lossOf = (one) => one.counters.reduce((sum, counter) => sum + (counter.kind === "loss" ? counter.count : 0), 0);

function makeHeads() {
  $("route-table").tHead.rows[0].replaceChildren(...COLUMNS.map((column, i) => {
    const head = make("th", {scope: "col"});
    if (!column.title) {
      head.setAttribute("aria-label", "Direction");
      return head;
    }
    const button = make("button", {type: "button", textContent: column.title, title: "Sort"});
    button.onclick = () => {
      page.backwards = page.order === i ? !page.backwards : i >= 4 && i <= 7;
      page.order = i;
      page.first = 0;
      for (const one of $("route-table").tHead.rows[0].cells) one.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", page.backwards ? "descending" : "ascending");
      show();
    };
    head.append(button);
    return head;
  }));
}

function showRoutes(picture) {
  const words = wordsOf($("filter").value);
  const found = picture.routes.filter((one) => matches(one, words));
  if (page.order !== "") {
    const {of} = COLUMNS[page.order];
    found.sort((a, b) => {
      const [x, y] = [of(a), of(b)];
      return (typeof x === "number" ? x - y : x.localeCompare(y)) * (page.backwards ? -1 : 1);
    });
  }
  page.first = Math.max(0, Math.min(page.first, Math.floor((found.length - 1) / ROWS) * ROWS));
  const seen = found.slice(page.first, page.first + ROWS);
  put($("route-count"), `${found.length === picture.routes.length ? "" : `${whole(found.length)} of `}${counted(picture.routes.length, "route")}`);
  put($("page-number"), found.length > ROWS ? `${page.first + 1} – ${page.first + seen.length}` : "");
  $("before").hidden = $("after").hidden = found.length <= ROWS;
  $("before").disabled = page.first === 0;
  $("after").disabled = page.first + ROWS >= found.length;
  const body = $("route-table").tBodies[0];
  fill(body, seen.map((one, i) => {
    const row = body.rows[i];
    const link = row && row.querySelector("a") || make("a");
    if (link.getAttribute("href") !== linkOf(one)) link.href = linkOf(one);
    put(link, one.name);
    return [link, arrowOf(one), mono(idsOf(one)), {text: one.state, className: stateClass[one.state]},
      numeric(one.kind === "pattern" ? rateText(one) : figure(one.per_second)), numeric(figure(one.bytes_per_second / 1e6)),
      numeric(lastText(one, picture)), numeric(lossOf(one) ? whole(lossOf(one)) : "–", lossOf(one) ? "warn" : ""),
      {text: one.cause.words, className: "bad words"}];
  }));
}

// ---- asking ----

function state(text, className) {
  put($("state"), text, className);
}

async function look() {
  let later = EVERY;
  try {
    if (!document.hidden || !page.picture) {
      const first = !page.picture;
      page.picture = await (await ask("/status.json")).json();
      await record.look();
      page.history.note(page.picture);
      limits.note(page.picture);
      page.failed = 0;
      sessionStorage.setItem("token", page.token);
      $("ask-token").hidden = true;
      const {picture} = page;
      const flowing = picture.routes.filter((one) => one.state === "flowing").length;
      const failing = picture.routes.filter((one) => one.state === "failing").length;
      const running = picture.stopping ? "stopping" : `running for ${ago(picture.running_s)}`;
      const flow = `${flowing} of ${counted(picture.routes.length, "route")} flow`;
      state(`${running}, ${flow}${failing ? `, ${failing} fail` : ""}`, failing ? "bad" : "faint");
      if (first) go();
      else show();
    }
  } catch (error) {
    if (error.status === 401) {
      askForToken();
      return;
    }
    ++page.failed;
    later = Math.min(10 * EVERY, EVERY * 2 ** Math.min(page.failed, 4));
    state(error.message, "bad");
  }
  setTimeout(look, later);
}

function askForToken() {
  $("token-fault").textContent = page.token ? "That is not the token." : "";
  page.token = "";
  page.picture = null;
  sessionStorage.removeItem("token");
  for (const name of [...VIEWS, "record"]) $(name).hidden = true;
  state("waiting for the token", "faint");
  $("ask-token").hidden = false;
  $("token").value = "";
  $("token").focus();
}

$("ask-token").onsubmit = (event) => {
  event.preventDefault();
  page.token = $("token").value;
  look();
};
for (const name of ["filter", "graph-filter"]) {
  $(name).oninput = () => {
    page.first = 0;
    show();
  };
}
$("before").onclick = () => {
  page.first -= ROWS;
  show();
};
$("after").onclick = () => {
  page.first += ROWS;
  show();
};
document.addEventListener("visibilitychange", show);
window.addEventListener("hashchange", () => {
  go();
  $("main").focus();
});
makeHeads();
go();
look();
