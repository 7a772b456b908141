// SPDX-License-Identifier: BSD-3-Clause
#define DOCTEST_CONFIG_IMPLEMENT
#include "Testing/Shared/Check.h"
#include "Testing/Shared/TestRun.h"

#include <cmath>
#include <cstdio>
#include <ostream>

namespace SurfelTesting
{
namespace
{
int NumberOfChecks = 0;

/// Prints each test's name and duration; counts the checks.
class Reporter : public doctest::IReporter
{
public:
  explicit Reporter(const doctest::ContextOptions&) {}
  void test_case_start(const doctest::TestCaseData& test) override { this->Name = test.m_name; }
  void test_case_end(const doctest::CurrentTestCaseStats& test) override
  {
    std::printf(
      "%-6s %8.3f s  %s\n", test.testCaseSuccess ? "ok" : "FAILED", test.seconds, this->Name);
  }
  void test_run_end(const doctest::TestRunStats& run) override { NumberOfChecks = run.numAsserts; }
  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}

private:
  const char* Name = "";
};
REGISTER_LISTENER("tests", 1, Reporter);
}

Near::operator bool() const
{
  return std::abs(this->Actual - this->Expected) <= this->Tolerance;
}

std::ostream& operator<<(std::ostream& stream, const Near& near)
{
  char text[160];
  std::snprintf(text, sizeof text, "%.9g, expected %.9g within %.3g (off by %.3g)", near.Actual,
    near.Expected, near.Tolerance, near.Actual - near.Expected);
  return stream << text;
}
}

int main(int argc, char* argv[])
{
  using namespace SurfelTesting;
  if (argc > 1 && argv[1][0] != '-')
  {
    ThisRun.Variant = argv[1];
  }
  doctest::Context context;
  context.setOption("no-intro", true);
  context.setOption("abort-after", 40);
  context.applyCommandLine(argc, argv);
  const int result = context.run();
  if (result != 0 || context.shouldExit())
  {
    return result;
  }
  if (!ThisRun.SkipReason.empty())
  {
    constexpr int skipped = 77;
    std::printf("skipped: %s\n", ThisRun.SkipReason.c_str());
    return skipped;
  }
  if (NumberOfChecks == 0)
  {
    std::printf("nothing was checked\n");
    return 1;
  }
  return 0;
}
