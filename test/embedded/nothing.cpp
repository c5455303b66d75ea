// A program that does nothing: what is linked to it is looked at.
int main() {
  return 0;
}
