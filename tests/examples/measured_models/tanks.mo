model Tanks "two tanks in series, the upper one drains into the lower one; levels in volts of the sensor"
  parameter Real g(unit="1/s", min=0) = 0.05 "inflow for one volt at the pump";
  parameter Real k1(unit="V^0.5/s", min=0) = 0.05 "outlet of the upper tank";
  parameter Real k2(unit="V^0.5/s", min=0) = 0.05 "outlet of the lower tank";
  input Real u(unit="V") "command to the pump";
  output Real y(unit="V") = h2 "reading of the lower level";
  Real h1(quantity="Level", unit="V", start=5) "upper level";
  Real h2(quantity="Level", unit="V", start=5) "lower level";
equation
  der(h1) = g*u - k1*sqrt(max(h1, 0.0001));
  der(h2) = k1*sqrt(max(h1, 0.0001)) - k2*sqrt(max(h2, 0.0001));
end Tanks;
