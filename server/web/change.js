// What may become of a dataset that is there: another title, or its end. A dialog says what that means before it is done.
import { base_of, send } from "./service.js";

const element = (id) => document.getElementById(id);

// The value of the button that closes it; of Escape an empty one.
function answer_of(dialog) {
  dialog.returnValue = "";
  dialog.showModal();
  // The event comes a little later: that of an answer before may come while the dialog is open again.
  return new Promise((then) => { dialog.onclose = () => { if (!dialog.open) then(dialog.returnValue); }; });
}

// Whether somebody wants it to go.
export async function is_to_go(label) {
  element("deleting-title").textContent = `Delete “${label}”?`;
  return (await answer_of(element("deleting"))) === "delete";
}

// Somebody else may have been quicker: then it is gone as well.
export const delete_dataset = (id) => send("DELETE", base_of(id)).catch((error) => { if (error.status !== 404) throw error; });

// Whether it has another title now.
export async function rename(id, title) {
  const field = element("new-title");
  field.value = title;
  const wanted = (await answer_of(element("renaming"))) === "rename" && field.value.trim() !== title;
  if (wanted) await send("PATCH", base_of(id), { title: field.value.trim() });
  return wanted;
}
